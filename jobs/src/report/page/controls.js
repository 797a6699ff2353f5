
// User input: selecting frames, zooming, pointing, clicking.

// How far from a slice the pointer still hits it, and how far it moves before it drags, in pixels.
const HIT_DISTANCE = 3;
const ZOOM_STEP = 1.5;
// The shortest interval that can be shown, in nanoseconds.
const MIN_INTERVAL = 20;

const extent = { from: 0, to: 1 };
let isRedrawScheduled = false;

function redraw() {
    if (!isRedrawScheduled) {
        isRedrawScheduled = true;
        requestAnimationFrame(draw);
    }
}

function draw() {
    isRedrawScheduled = false;
    drawTracks();
    drawAxis();
    drawStrip();
    document.body.dataset.ready = "true";
}

function resize() {
    layOutTracks();
    redraw();
}

// The interval of everything that was recorded.
function measureExtent() {
    let [from, to] = [Infinity, -Infinity];
    const widen = (began, ended) => ([from, to] = [Math.min(from, began), Math.max(to, ended)]);
    data.frames.forEach((frame) => widen(frame.began, frame.ended));
    for (let slice = 0; slice < slices.count; slice += 1) {
        widen(slices.began[slice], slices.ended[slice]);
    }
    return from < to ? { from, to } : { from: 0, to: 1e6 };
}

// Shows an interval, clamped to the extent of the log.
function showInterval(from, to) {
    const margin = (extent.to - extent.from) * 0.05 + 100;
    const length = Math.min(Math.max(to - from, MIN_INTERVAL), extent.to - extent.from + 2 * margin);
    state.from = Math.min(Math.max(from, extent.from - margin), extent.to + margin - length);
    state.to = state.from + length;
    redraw();
}

function zoom(factor, time = (state.from + state.to) / 2) {
    const length = Math.max((state.to - state.from) / factor, MIN_INTERVAL);
    const ratio = length / (state.to - state.from);
    const from = time - (time - state.from) * ratio;
    showInterval(from, from + length);
}

function pan(share) {
    const shift = (state.to - state.from) * share;
    showInterval(state.from + shift, state.to + shift);
}

function fitFrame() {
    const { began: from, ended: to } = data.frames[state.frame] ?? { began: extent.from, ended: extent.to };
    const margin = Math.max(to - from, MIN_INTERVAL) * 0.02;
    showInterval(from - margin, to + margin);
}

function selectFrame(frame) {
    if (frame < 0 || frame >= data.frames.length) {
        return;
    }
    state.frame = frame;
    const { number, report, began, ended } = data.frames[frame];
    byId("frame-select").value = String(frame);
    byId("previous").disabled = frame === 0;
    byId("next").disabled = frame === data.frames.length - 1;
    byId("heading").textContent = `Frame ${number}: ${formatDuration(ended - began)}`;
    byId("report").textContent = data.texts[report];
    const ofFrame = runs.filter((run) => run.frame === number);
    document.body.dataset.frame = String(number);
    document.body.dataset.jobs = String(ofFrame.reduce((sum, run) => sum + run.chunks.length / CHUNK_NUMBERS, 0));
    measureBusy();
    selectSlice(-1);
    fitFrame();
}

function selectSlice(slice) {
    const selected = slice >= 0 && isOfRun(slice) ? slice : -1;
    state.selected = selected;
    state.highlighted = selected < 0 ? null : predecessorsOf(selected);
    const dependsOnSelected = (node) => node.dependencies.includes(slices.node[selected]);
    const { nodes } = selected < 0 ? { nodes: [] } : runs[slices.run[selected]];
    state.dependents = nodes.flatMap((node, index) => (dependsOnSelected(node) ? [index] : []));
    document.body.dataset.chain = selected < 0 ? "" : String(chainOf(selected).length);
    showChain();
    redraw();
}

function search(query) {
    const wanted = query.trim().toLowerCase();
    state.matches = wanted === "" ? null : Uint8Array.from(data.texts, (text) => text.toLowerCase().includes(wanted));
    redraw();
}

// The slice at that point of the canvas, or the nearest within `HIT_DISTANCE`, or −1.
function sliceAt(x, y) {
    const height = y + byId("scroller").scrollTop;
    const track = tracks.find((track) => height >= track.top && height < track.top + track.height);
    const row = x < GUTTER ? undefined : track?.rows[Math.floor((height - track.top) / size.row)];
    if (!row) {
        return -1;
    }
    const at = firstEndingAfter(row, timeAt(x));
    const distance = (slice) => Math.max(xOf(slices.began[slice]) - x, x - xOf(slices.ended[slice]), 0);
    const near = [row[at], row[at - 1]].filter((slice) => slice !== undefined && distance(slice) <= HIT_DISTANCE);
    return near.sort((one, other) => distance(one) - distance(other))[0] ?? -1;
}

function pointAt(slice, x, y) {
    const tooltip = byId("tooltip");
    if (slice !== state.hovered) {
        state.hovered = slice;
        redraw();
    }
    tooltip.hidden = slice < 0;
    if (slice >= 0) {
        tooltip.replaceChildren(...describeSlice(slice));
        const [width, height] = [tooltip.offsetWidth, tooltip.offsetHeight];
        tooltip.style.left = `${Math.max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`;
        tooltip.style.top = `${Math.max(4, Math.min(y + 18, innerHeight - height - 6))}px`;
    }
}

// Scrolls to a slice unless it is visible, and outlines it.
function reveal(slice) {
    state.hovered = slice;
    if (slices.began[slice] < state.from || slices.ended[slice] > state.to) {
        const length = Math.max(state.to - state.from, (slices.ended[slice] - slices.began[slice]) * 1.5);
        const middle = (slices.began[slice] + slices.ended[slice]) / 2;
        showInterval(middle - length / 2, middle + length / 2);
    }
    redraw();
}

function applyTheme() {
    readTheme();
    fillLegend();
    resize();
}

function addCanvasListeners() {
    const canvas = byId("tracks");
    let drag = null;
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
        if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
            pan((event.deltaX * pixels) / (size.width - GUTTER));
        } else {
            zoom(2 ** ((-event.deltaY * pixels) / 240), timeAt(Math.max(event.offsetX, GUTTER)));
        }
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
        const { clientX: x, clientY: y } = event;
        const start = { x, y, from: state.from, top: byId("scroller").scrollTop, hasMoved: false };
        drag = event.button === 0 ? start : null;
    });
    window.addEventListener("pointermove", (event) => {
        if (drag) {
            const [x, y] = [event.clientX - drag.x, event.clientY - drag.y];
            drag.hasMoved ||= Math.hypot(x, y) > HIT_DISTANCE;
            if (drag.hasMoved) {
                canvas.classList.add("dragged");
                const from = drag.from - x / scale();
                showInterval(from, from + (state.to - state.from));
                byId("scroller").scrollTop = drag.top - y;
                pointAt(-1);
            }
        } else if (event.target === canvas) {
            pointAt(sliceAt(event.offsetX, event.offsetY), event.clientX, event.clientY);
        }
    });
    window.addEventListener("pointerup", (event) => {
        if (drag && !drag.hasMoved) {
            selectSlice(sliceAt(event.offsetX, event.offsetY));
        }
        drag = null;
        canvas.classList.remove("dragged");
    });
    window.addEventListener("pointercancel", () => (drag = null));
    canvas.addEventListener("pointerleave", () => pointAt(-1));
    byId("scroller").addEventListener("scroll", redraw);
}

function addListeners() {
    addCanvasListeners();
    const clicks = {
        previous: () => selectFrame(state.frame - 1),
        next: () => selectFrame(state.frame + 1),
        "zoom-in": () => zoom(ZOOM_STEP),
        "zoom-out": () => zoom(1 / ZOOM_STEP),
        fit: fitFrame,
        "critical-path": redraw,
        "frame-strip": (event) => selectFrame(frameAt(event.offsetX)),
    };
    Object.entries(clicks).forEach(([id, action]) => byId(id).addEventListener("click", action));
    byId("frame-select").addEventListener("change", (event) => selectFrame(Number(event.target.value)));
    byId("search").addEventListener("input", (event) => search(event.target.value));
    const keys = {
        ArrowLeft: () => pan(-0.15),
        ArrowRight: () => pan(0.15),
        ArrowUp: () => (byId("scroller").scrollTop -= size.row),
        ArrowDown: () => (byId("scroller").scrollTop += size.row),
        "+": () => zoom(ZOOM_STEP),
        "=": () => zoom(ZOOM_STEP),
        "-": () => zoom(1 / ZOOM_STEP),
        "0": fitFrame,
        Escape: () => selectSlice(-1),
    };
    window.addEventListener("keydown", (event) => {
        const isText = event.target.matches("input[type=search], select, pre");
        const isShortcut = event.ctrlKey || event.metaKey || event.altKey;
        if (!isText && !isShortcut && Object.hasOwn(keys, event.key)) {
            event.preventDefault();
            keys[event.key]();
        }
    });
    new ResizeObserver(resize).observe(byId("scroller"));
    window.addEventListener("resize", resize);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", applyTheme);
}

Object.assign(extent, measureExtent());
fillFrameList();
addListeners();
applyTheme();
selectSlice(-1);
// Select the longest frame first: a slow frame is why one opens the page.
const longest = (one, other, at) => {
    const duration = ({ began, ended }) => ended - began;
    return one < 0 || duration(other) > duration(data.frames[one]) ? at : one;
};
selectFrame(data.frames.reduce(longest, -1));
fitFrame();
