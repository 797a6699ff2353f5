// Uses the page by dispatching the events that a browser sends, and reports for each step whether it had the expected effect.

async function usePage() {
    const outcome = [];
    const check = (step, isRight) => outcome.push(`${step}=${isRight}`);
    // The page requests its own animation frame first, so it has drawn when this one arrives.
    const drawn = () => new Promise((resolve) => requestAnimationFrame(resolve));
    const canvas = byId("tracks");
    const pointer = (type, x, y) => {
        const { left, top } = canvas.getBoundingClientRect();
        const options = { bubbles: true, cancelable: true, clientX: left + x, clientY: top + y };
        canvas.dispatchEvent(new PointerEvent(type, options));
    };
    const wheel = (x, deltaY) => {
        const { left, top } = canvas.getBoundingClientRect();
        const options = { bubbles: true, cancelable: true, clientX: left + x, clientY: top + 5, deltaY };
        canvas.dispatchEvent(new WheelEvent("wheel", options));
    };
    const press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
    const length = () => state.to - state.from;
    const isNear = (one, other) => Math.abs(one - other) < length() / 1000;
    const { dataset } = document.body;

    await drawn();
    const whole = [state.from, state.to];
    check("the-longest-frame-is-first", dataset.frame === "1" && dataset.jobs === "5");
    check("its-report-is-shown", byId("report").textContent.includes("frame 1"));
    check("all-frames-are-listed", byId("frame-select").options.length === 3);

    const timeUnderPointer = timeAt(500);
    wheel(500, -240);
    const isHalf = isNear(length(), (whole[1] - whole[0]) / 2);
    check("the-wheel-zooms-at-the-pointer", isHalf && isNear(timeAt(500), timeUnderPointer));
    wheel(500, 240);
    check("and-back-out", isNear(state.from, whole[0]) && isNear(state.to, whole[1]));
    press("+");
    const closer = length();
    check("plus-zooms", closer < whole[1] - whole[0]);
    const from = state.from;
    press("ArrowRight");
    check("arrows-move", state.from > from && isNear(length(), closer));
    press("0");
    check("zero-fits-the-frame", state.from === whole[0] && state.to === whole[1]);
    const before = timeAt(400);
    pointer("pointerdown", 400, 20);
    pointer("pointermove", 460, 20);
    pointer("pointerup", 460, 20);
    check("dragging-moves", isNear(timeAt(460), before) && state.selected === -1);
    byId("fit").click();

    const run = runs[1];
    const last = edgeSlicesOf(run).last[3];
    const middleOfLast = () => [(xOf(slices.began[last]) + xOf(slices.ended[last])) / 2, topOf(last) + size.row / 2];
    await drawn();
    const density = window.devicePixelRatio;
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const color = (x, y) => {
        const at = 4 * (Math.round(y * density) * pixels.width + Math.round(x * density));
        return pixels.data.slice(at, at + 3).join();
    };
    const height = topOf(last) + 4;
    const empty = xOf(run.began + (run.ended - run.began) * 0.55);
    check("a-chunk-is-drawn", color(xOf(slices.began[last]) + 8, height) !== color(empty, height));

    pointer("pointermove", ...middleOfLast());
    const tooltip = byId("tooltip").textContent;
    check("the-tooltip-names-the-chunk", !byId("tooltip").hidden && tooltip.startsWith("end"));
    check("it-says-how-long-the-chunk-waited", tooltip.includes("queued20.0 µs: 4.00 µs until its node was opened, then 16.0 µs"));
    check("how-long-it-ran", tooltip.includes("ran50.0 µs"));
    check("and-what-it-waited-for", tooltip.includes("waited forright, which ended at 0.120 ms"));
    pointer("pointerdown", ...middleOfLast());
    pointer("pointerup", ...middleOfLast());
    check("a-click-highlights-the-chain", dataset.chain === "3" && state.highlighted.join() === "1,1,1,1");
    const listed = [...byId("chain").querySelectorAll("td:first-child")].map((cell) => cell.textContent).join();
    check("which-is-listed", listed === "end,right,root,the start of the run");
    byId("chain").querySelector("button").click();
    press("Escape");
    check("escape-deselects", dataset.chain === "" && state.selected === -1);

    const path = criticalPath().map(({ beside }) => `${nameOf(beside)} on ${tracks[slices.track[beside]].label}`);
    const expected = "work on main,root on caller,right on other,end on caller";
    check("the-critical-path-goes-through-its-workers", [...new Set(path)].join() === expected);
    const isWork = ({ beside, isWait }) => nameOf(beside) === "work" && !isWait;
    check("it-begins-and-ends-with-the-thread-at-work", [2, -1].every((at) => isWork(criticalPath().at(at))));
    byId("critical-path").click();

    byId("search").value = "LEFT";
    byId("search").dispatchEvent(new Event("input", { bubbles: true }));
    check("search-finds", isHighlighted(edgeSlicesOf(run).last[1]) && !isHighlighted(last));
    byId("search").value = "";
    byId("search").dispatchEvent(new Event("input", { bubbles: true }));

    byId("next").click();
    check("next-is-the-next-frame", dataset.frame === "2" && byId("next").disabled && state.from > whole[0]);
    byId("previous").click();
    byId("frame-select").value = "0";
    byId("frame-select").dispatchEvent(new Event("change", { bubbles: true }));
    check("the-list-selects-a-frame", dataset.frame === "0" && byId("previous").disabled);
    const { left, top } = byId("frame-strip").getBoundingClientRect();
    const { bar } = stripLayout();
    const second = { bubbles: true, clientX: left + 16 + bar * 1.5, clientY: top + 5 };
    byId("frame-strip").dispatchEvent(new MouseEvent("click", second));
    check("so-does-the-strip", dataset.frame === "1");
    await drawn();
    dataset.outcome = outcome.join(" ");
}

usePage();
