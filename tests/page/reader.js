// Goes through the page as a reader does, by the events that a browser sends, and tells of each step whether it did what it
// should.

async function read() {
    const outcome = [];
    const tell = (step, isRight) => outcome.push(`${step}=${isRight}`);
    const drawn = () => new Promise((resolve) => setTimeout(resolve, 100));
    const picture = part("picture");
    const point = (type, x, y) => {
        const { left, top } = picture.getBoundingClientRect();
        const options = { bubbles: true, cancelable: true, clientX: left + x, clientY: top + y };
        picture.dispatchEvent(new PointerEvent(type, options));
    };
    const turn = (x, deltaY) => {
        const { left, top } = picture.getBoundingClientRect();
        const options = { bubbles: true, cancelable: true, clientX: left + x, clientY: top + 5, deltaY };
        picture.dispatchEvent(new WheelEvent("wheel", options));
    };
    const press = (key) => picture.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
    const length = () => state.to - state.from;
    const isNear = (one, other) => Math.abs(one - other) < length() / 1000;
    const { dataset } = document.body;

    await drawn();
    const whole = [state.from, state.to];
    tell("the-longest-frame-is-first", dataset.frame === "1" && dataset.jobs === "5");
    tell("its-words-are-there", part("words").textContent.includes("frame 1"));
    tell("all-frames-are-listed", part("chooser").options.length === 3);

    const under = momentAt(500);
    turn(500, -240);
    const isHalf = isNear(length(), (whole[1] - whole[0]) / 2);
    tell("the-wheel-zooms-where-it-points", isHalf && isNear(momentAt(500), under));
    turn(500, 240);
    tell("and-back", isNear(state.from, whole[0]) && isNear(state.to, whole[1]));
    press("+");
    const closer = length();
    tell("plus-zooms", closer < whole[1] - whole[0]);
    const from = state.from;
    press("ArrowRight");
    tell("arrows-move", state.from > from && isNear(length(), closer));
    press("0");
    tell("zero-fits-the-frame", state.from === whole[0] && state.to === whole[1]);
    const before = momentAt(400);
    point("pointerdown", 400, 20);
    point("pointermove", 460, 20);
    point("pointerup", 460, 20);
    tell("dragging-moves", isNear(momentAt(460), before) && state.selected === -1);
    part("fit").click();

    const run = runs[1];
    const last = factsOf(run).last[3];
    const place = () => [(xOf(slices.began[last]) + xOf(slices.ended[last])) / 2, topOf(last) + size.row / 2];
    await drawn();
    const density = window.devicePixelRatio;
    const pixels = picture.getContext("2d").getImageData(0, 0, picture.width, picture.height);
    const color = (x, y) => {
        const at = 4 * (Math.round(y * density) * pixels.width + Math.round(x * density));
        return pixels.data.slice(at, at + 3).join();
    };
    const height = topOf(last) + 4;
    const empty = xOf(run.began + (run.ended - run.began) * 0.55);
    tell("a-chunk-is-drawn", color(xOf(slices.began[last]) + 8, height) !== color(empty, height));

    point("pointermove", ...place());
    const tip = part("tip").textContent;
    tell("the-tip-names-the-chunk", !part("tip").hidden && tip.startsWith("end"));
    tell("it-tells-how-long-it-waited", tip.includes("queued20.0 µs: 4.00 µs until its process was opened, then 16.0 µs"));
    tell("and-ran", tip.includes("ran50.0 µs"));
    tell("and-for-what", tip.includes("waited forright, which ended at 0.120 ms"));
    point("pointerdown", ...place());
    point("pointerup", ...place());
    tell("a-click-lights-the-chain", dataset.chain === "3" && state.lit.join() === "1,1,1,1");
    const told = [...part("chain").querySelectorAll("td:first-child")].map((cell) => cell.textContent).join();
    tell("which-is-told-in-words", told === "end,right,root,the start of the run");
    part("chain").querySelector("button").click();
    press("Escape");
    tell("escape-lets-go", dataset.chain === "" && state.selected === -1);

    const path = criticalPath().map(({ beside }) => `${nameOf(beside)} on ${lanes[slices.lane[beside]].label}`);
    const expected = "work on main,root on caller,right on other,end on caller";
    tell("the-critical-path-goes-through-its-workers", [...new Set(path)].join() === expected);
    const isWork = ({ beside, isWait }) => nameOf(beside) === "work" && !isWait;
    tell("it-begins-and-ends-with-the-thread-at-work", [2, -1].every((at) => isWork(criticalPath().at(at))));
    part("critical").click();

    part("search").value = "LEFT";
    part("search").dispatchEvent(new Event("input", { bubbles: true }));
    tell("search-finds", isLit(factsOf(run).last[1]) && !isLit(last));
    part("search").value = "";
    part("search").dispatchEvent(new Event("input", { bubbles: true }));

    part("next").click();
    tell("next-is-the-next-frame", dataset.frame === "2" && part("next").disabled && state.from > whole[0]);
    part("previous").click();
    part("chooser").value = "0";
    part("chooser").dispatchEvent(new Event("change", { bubbles: true }));
    tell("the-chooser-chooses", dataset.frame === "0" && part("previous").disabled);
    const { left, top } = part("strip").getBoundingClientRect();
    const { bar } = stripOf();
    const second = { bubbles: true, clientX: left + 16 + bar * 1.5, clientY: top + 5 };
    part("strip").dispatchEvent(new MouseEvent("click", second));
    tell("so-does-the-strip", dataset.frame === "1");
    await drawn();
    dataset.outcome = `${outcome.join(" ")} done`;
}

read();
