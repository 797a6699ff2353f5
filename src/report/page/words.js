
// What the page tells in words: the tip at the pointer, chains, the legend, the list of frames.

// The longest name that is written out, in letters.
const LONGEST_NAME = 240;

function element(tag, text, children = []) {
    const made = document.createElement(tag);
    made.textContent = text;
    made.append(...children);
    return made;
}

const written = (text) => shortened(data.texts[text], LONGEST_NAME);

// A moment of the chosen frame, to the microsecond whatever its length, so that moments can be compared.
const momentInWords = (moment) => `${((moment - origin()) / 1e6).toFixed(3)} ms`;

function awaitedInWords(slice) {
    const run = runs[slices.run[slice]];
    const awaited = awaitedBy(run, slices.process[slice]);
    return awaited < 0
        ? "the start of the run"
        : `${shortened(nameOf(awaited), LONGEST_NAME)}, which ended at ${momentInWords(slices.ended[awaited])}`;
}

function tellSlice(slice) {
    const took = slices.ended[slice] - slices.began[slice];
    const lines = [];
    const tell = (name, text) => lines.push(element("dt", name), element("dd", text));
    const title = element("h3", shortened(nameOf(slice), LONGEST_NAME));
    tell("began", `${momentInWords(slices.began[slice])} into the frame`);
    if (!isOfRun(slice)) {
        if (slices.kind[slice] === PASS) {
            tell("view", written(slices.run[slice]));
            tell("known to", `±${inWords(data.device.error)}`);
        }
        tell("took", inWords(took));
        return [title, element("dl", "", lines)];
    }
    const node = nodeOf(slice);
    const waited = Math.max(slices.began[slice] - readyAt(slice), 0);
    const turn = Math.min(Math.max(slices.began[slice] - slices.opened[slice], 0), waited);
    const share = element("div", "", [element("i", ""), element("i", "")]);
    share.className = "share";
    share.children[0].style.flexGrow = String(waited);
    share.children[1].style.flexGrow = String(took);
    share.children[1].style.background = cssOf(slice);
    const parts = `: ${inWords(waited - turn)} until its process was opened, then ${inWords(turn)}`;
    tell("queued", `${inWords(waited)}${turn > 0 && turn < waited ? parts : ""}`);
    tell("ran", inWords(took));
    tell("waited for", awaitedInWords(slice));
    if (node.group !== node.name) {
        tell("process", written(node.group));
    }
    if (node.color !== node.group) {
        tell("stage", written(node.color));
    }
    if (node.view !== null) {
        tell("view", written(node.view));
    }
    const [first, items] = [slices.first[slice], slices.items[slice]];
    tell("items", items < 2 ? ["none", `number ${first}`][items] : `${items}, numbers ${first} to ${first + items - 1}`);
    const how = `${slices.stolen[slice] ? "stolen" : "not stolen"}${node.pinned ? ", pinned to the calling thread" : ""}`;
    tell("worker", `${shortened(lanes[slices.lane[slice]].label, LONGEST_NAME)}, ${how}`);
    return [title, share, element("dl", "", lines)];
}

function tellChain() {
    if (state.selected < 0) {
        const hint = "Click a chunk to see what it waited for, step by step. The wheel zooms, dragging moves; "
            + "on the keyboard: arrows, + and −, 0 for the whole frame, Escape to let go.";
        part("chain").replaceChildren(element("p", hint));
        return;
    }
    const head = ["What it waited for, latest first", "queued", "ran", "ended at"].map((text) => element("th", text));
    const rows = chainOf(state.selected).map((slice) => {
        const name = element("button", shortened(nameOf(slice), LONGEST_NAME));
        name.type = "button";
        name.addEventListener("click", () => reveal(slice));
        const { first } = factsOf(runs[slices.run[slice]]);
        const began = slices.began[slice === state.selected ? slice : first[slices.process[slice]]];
        const [waited, took] = [began - readyAt(slice), slices.ended[slice] - began];
        const cells = [inWords(waited), inWords(took), momentInWords(slices.ended[slice])];
        return element("tr", "", [element("td", "", [name]), ...cells.map((text) => element("td", text))]);
    });
    const start = element("tr", "", [element("td", "the start of the run")]);
    const title = element("h2", `Chain of ${shortened(nameOf(state.selected), LONGEST_NAME)}`);
    part("chain").replaceChildren(title, element("table", "", [element("tr", "", head), ...rows, start]));
}

function fillLegend() {
    const item = (text, className, css = "") => {
        const swatch = element("i", "");
        swatch.className = className;
        swatch.style.background = css;
        return element("li", "", [swatch, text]);
    };
    const stages = [...colors].map(([text, color]) => item(shortened(data.texts[text], 60), "", color.css));
    const spans = data.spans.length > 0 ? [item("span of a thread", "", "var(--span)")] : [];
    const others = [item("searching", "searching"), item("asleep", "asleep"), item("critical path", "critical")];
    part("legend").replaceChildren(...stages, ...spans, ...others);
}

function fillChooser() {
    const option = ({ number, began, ended }, frame) => {
        const made = element("option", `frame ${number} · ${inWords(ended - began)}`);
        made.value = String(frame);
        return made;
    };
    part("chooser").replaceChildren(...data.frames.map(option));
    part("note").classList.toggle("lost", data.dropped > 0);
    part("note").textContent = data.dropped > 0
        ? `${data.dropped} events were dropped: there was no room for them.`
        : data.frames.length === 0 ? "Nothing was recorded." : "";
}
