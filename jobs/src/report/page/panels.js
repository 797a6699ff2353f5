
// The page's text: the tooltip, the chain of dependencies, the legend, and the list of frames.

// The maximum length of a name, in UTF-16 code units.
const MAX_NAME_LENGTH = 240;

function element(tag, text, children = []) {
    const created = document.createElement(tag);
    created.textContent = text;
    created.append(...children);
    return created;
}

const textAt = (text) => truncated(data.texts[text], MAX_NAME_LENGTH);

// Formats a point in time since the start of the selected frame. Always in milliseconds, so that times can be compared.
const formatTime = (time) => `${((time - origin()) / 1e6).toFixed(3)} ms`;

function describeLastDependency(slice) {
    const run = runs[slices.run[slice]];
    const dependency = lastDependencyOf(run, slices.node[slice]);
    return dependency < 0
        ? "the start of the run"
        : `${truncated(nameOf(dependency), MAX_NAME_LENGTH)}, which ended at ${formatTime(slices.ended[dependency])}`;
}

function describeSlice(slice) {
    const duration = slices.ended[slice] - slices.began[slice];
    const lines = [];
    const addRow = (name, text) => lines.push(element("dt", name), element("dd", text));
    const title = element("h3", truncated(nameOf(slice), MAX_NAME_LENGTH));
    addRow("began", `${formatTime(slices.began[slice])} into the frame`);
    if (!isOfRun(slice)) {
        if (slices.kind[slice] === PASS) {
            addRow("view", textAt(slices.run[slice]));
            addRow("known to", `±${formatDuration(data.device.error)}`);
        }
        addRow("took", formatDuration(duration));
        return [title, element("dl", "", lines)];
    }
    const node = nodeOf(slice);
    const waited = Math.max(slices.began[slice] - readyAt(slice), 0);
    const sinceOpened = Math.min(Math.max(slices.began[slice] - slices.opened[slice], 0), waited);
    const bar = element("div", "", [element("i", ""), element("i", "")]);
    bar.className = "share";
    bar.children[0].style.flexGrow = String(waited);
    bar.children[1].style.flexGrow = String(duration);
    bar.children[1].style.background = cssOf(slice);
    const parts = `: ${formatDuration(waited - sinceOpened)} until its node was opened, then ${formatDuration(sinceOpened)}`;
    addRow("queued", `${formatDuration(waited)}${sinceOpened > 0 && sinceOpened < waited ? parts : ""}`);
    addRow("ran", formatDuration(duration));
    addRow("waited for", describeLastDependency(slice));
    if (node.group !== node.name) {
        addRow("process", textAt(node.group));
    }
    if (node.color !== node.group) {
        addRow("stage", textAt(node.color));
    }
    if (node.view !== null) {
        addRow("view", textAt(node.view));
    }
    const [first, items] = [slices.first[slice], slices.items[slice]];
    addRow("items", items < 2 ? ["none", `number ${first}`][items] : `${items}, numbers ${first} to ${first + items - 1}`);
    const details = `${slices.stolen[slice] ? "stolen" : "not stolen"}${node.pinned ? ", pinned to the calling thread" : ""}`;
    addRow("worker", `${truncated(tracks[slices.track[slice]].label, MAX_NAME_LENGTH)}, ${details}`);
    return [title, bar, element("dl", "", lines)];
}

function showChain() {
    if (state.selected < 0) {
        const hint = "Click a chunk to see what it waited for, step by step. The wheel zooms, dragging moves; "
            + "on the keyboard: arrows, + and −, 0 for the whole frame, Escape to deselect.";
        byId("chain").replaceChildren(element("p", hint));
        return;
    }
    const head = ["What it waited for, latest first", "queued", "ran", "ended at"].map((text) => element("th", text));
    const rows = chainOf(state.selected).map((slice) => {
        const name = element("button", truncated(nameOf(slice), MAX_NAME_LENGTH));
        name.type = "button";
        name.addEventListener("click", () => reveal(slice));
        const { first } = edgeSlicesOf(runs[slices.run[slice]]);
        const began = slices.began[slice === state.selected ? slice : first[slices.node[slice]]];
        const [waited, duration] = [began - readyAt(slice), slices.ended[slice] - began];
        const cells = [formatDuration(waited), formatDuration(duration), formatTime(slices.ended[slice])];
        return element("tr", "", [element("td", "", [name]), ...cells.map((text) => element("td", text))]);
    });
    const start = element("tr", "", [element("td", "the start of the run")]);
    const title = element("h2", `Chain of ${truncated(nameOf(state.selected), MAX_NAME_LENGTH)}`);
    byId("chain").replaceChildren(title, element("table", "", [element("tr", "", head), ...rows, start]));
}

function fillLegend() {
    const item = (text, className, css = "") => {
        const swatch = element("i", "");
        swatch.className = className;
        swatch.style.background = css;
        return element("li", "", [swatch, text]);
    };
    const stages = [...colors].map(([text, color]) => item(truncated(data.texts[text], 60), "", color.css));
    const spans = data.spans.length > 0 ? [item("span of a thread", "", "var(--span)")] : [];
    const others = [item("searching", "searching"), item("asleep", "asleep"), item("critical path", "critical")];
    byId("legend").replaceChildren(...stages, ...spans, ...others);
}

function fillFrameList() {
    const option = ({ number, began, ended }, frame) => {
        const created = element("option", `frame ${number} · ${formatDuration(ended - began)}`);
        created.value = String(frame);
        return created;
    };
    byId("frame-select").replaceChildren(...data.frames.map(option));
    byId("status").classList.toggle("lost", data.dropped > 0);
    byId("status").textContent = data.dropped > 0
        ? `${data.dropped} events were dropped: there was no room for them.`
        : data.frames.length === 0 ? "Nothing was recorded." : "";
}
