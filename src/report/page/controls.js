
// What the reader does: choosing frames, zooming, pointing, clicking.

// How far from a slice the pointer still means it, and how far it moves before it drags, in pixels.
const REACH = 3;
const ZOOM_STEP = 1.5;
// The shortest time that is shown, in nanoseconds.
const CLOSEST = 20;

const wide = { from: 0, to: 1 };
let isDue = false;

function redraw() {
    if (!isDue) {
        isDue = true;
        requestAnimationFrame(draw);
    }
}

function draw() {
    isDue = false;
    drawLanes();
    drawAxis();
    drawStrip();
    document.body.dataset.ready = "true";
}

function resize() {
    layOut();
    redraw();
}

// All that was recorded, from the first moment to the last.
function measureAll() {
    let [from, to] = [Infinity, -Infinity];
    const widen = (began, ended) => ([from, to] = [Math.min(from, began), Math.max(to, ended)]);
    data.frames.forEach((frame) => widen(frame.began, frame.ended));
    for (let slice = 0; slice < slices.count; slice += 1) {
        widen(slices.began[slice], slices.ended[slice]);
    }
    return from < to ? { from, to } : { from: 0, to: 1e6 };
}

// Shows that stretch of time, as far as there is anything to see.
function show(from, to) {
    const margin = (wide.to - wide.from) * 0.05 + 100;
    const length = Math.min(Math.max(to - from, CLOSEST), wide.to - wide.from + 2 * margin);
    state.from = Math.min(Math.max(from, wide.from - margin), wide.to + margin - length);
    state.to = state.from + length;
    redraw();
}

function zoom(factor, moment = (state.from + state.to) / 2) {
    const length = Math.max((state.to - state.from) / factor, CLOSEST);
    const kept = length / (state.to - state.from);
    const from = moment - (moment - state.from) * kept;
    show(from, from + length);
}

function pan(share) {
    const by = (state.to - state.from) * share;
    show(state.from + by, state.to + by);
}

function fitFrame() {
    const { began: from, ended: to } = data.frames[state.frame] ?? { began: wide.from, ended: wide.to };
    const margin = Math.max(to - from, CLOSEST) * 0.02;
    show(from - margin, to + margin);
}

function choose(frame) {
    if (frame < 0 || frame >= data.frames.length) {
        return;
    }
    state.frame = frame;
    const { number, words, began, ended } = data.frames[frame];
    part("chooser").value = String(frame);
    part("previous").disabled = frame === 0;
    part("next").disabled = frame === data.frames.length - 1;
    part("heading").textContent = `Frame ${number}: ${inWords(ended - began)}`;
    part("words").textContent = data.texts[words];
    const ofFrame = runs.filter((run) => run.frame === number);
    document.body.dataset.frame = String(number);
    document.body.dataset.jobs = String(ofFrame.reduce((sum, run) => sum + run.chunks.length / CHUNK_NUMBERS, 0));
    measureBusy();
    select(-1);
    fitFrame();
}

function select(slice) {
    const chosen = slice >= 0 && isOfRun(slice) ? slice : -1;
    state.selected = chosen;
    state.lit = chosen < 0 ? null : predecessorsOf(chosen);
    const waits = (node) => node.dependencies.includes(slices.process[chosen]);
    const { nodes } = chosen < 0 ? { nodes: [] } : runs[slices.run[chosen]];
    state.dependents = nodes.flatMap((node, process) => (waits(node) ? [process] : []));
    document.body.dataset.chain = chosen < 0 ? "" : String(chainOf(chosen).length);
    tellChain();
    redraw();
}

function find(words) {
    const wanted = words.trim().toLowerCase();
    state.found = wanted === "" ? null : Uint8Array.from(data.texts, (text) => text.toLowerCase().includes(wanted));
    redraw();
}

// The slice at that place of the canvas, or the nearest within reach; −1 if there is none.
function sliceAt(x, y) {
    const height = y + part("scroller").scrollTop;
    const lane = lanes.find((lane) => height >= lane.top && height < lane.top + lane.height);
    const row = x < GUTTER ? undefined : lane?.rows[Math.floor((height - lane.top) / size.row)];
    if (!row) {
        return -1;
    }
    const at = firstAfter(row, momentAt(x));
    const distance = (slice) => Math.max(xOf(slices.began[slice]) - x, x - xOf(slices.ended[slice]), 0);
    const near = [row[at], row[at - 1]].filter((slice) => slice !== undefined && distance(slice) <= REACH);
    return near.sort((one, other) => distance(one) - distance(other))[0] ?? -1;
}

function pointAt(slice, x, y) {
    const tip = part("tip");
    if (slice !== state.hovered) {
        state.hovered = slice;
        redraw();
    }
    tip.hidden = slice < 0;
    if (slice >= 0) {
        tip.replaceChildren(...tellSlice(slice));
        const [width, height] = [tip.offsetWidth, tip.offsetHeight];
        tip.style.left = `${Math.max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`;
        tip.style.top = `${Math.max(4, Math.min(y + 18, innerHeight - height - 6))}px`;
    }
}

// Moves there, unless it can be seen already, and points it out.
function reveal(slice) {
    state.hovered = slice;
    if (slices.began[slice] < state.from || slices.ended[slice] > state.to) {
        const length = Math.max(state.to - state.from, (slices.ended[slice] - slices.began[slice]) * 1.5);
        const middle = (slices.began[slice] + slices.ended[slice]) / 2;
        show(middle - length / 2, middle + length / 2);
    }
    redraw();
}

function paint() {
    readTheme();
    fillLegend();
    resize();
}

function listenToPicture() {
    const picture = part("picture");
    let held = null;
    picture.addEventListener("wheel", (event) => {
        event.preventDefault();
        const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
        if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
            pan((event.deltaX * pixels) / (size.width - GUTTER));
        } else {
            zoom(2 ** ((-event.deltaY * pixels) / 240), momentAt(Math.max(event.offsetX, GUTTER)));
        }
    }, { passive: false });
    picture.addEventListener("pointerdown", (event) => {
        const { clientX: x, clientY: y } = event;
        const place = { x, y, from: state.from, top: part("scroller").scrollTop, hasMoved: false };
        held = event.button === 0 ? place : null;
    });
    window.addEventListener("pointermove", (event) => {
        if (held) {
            const [x, y] = [event.clientX - held.x, event.clientY - held.y];
            held.hasMoved ||= Math.hypot(x, y) > REACH;
            if (held.hasMoved) {
                picture.classList.add("dragged");
                const from = held.from - x / scale();
                show(from, from + (state.to - state.from));
                part("scroller").scrollTop = held.top - y;
                pointAt(-1);
            }
        } else if (event.target === picture) {
            pointAt(sliceAt(event.offsetX, event.offsetY), event.clientX, event.clientY);
        }
    });
    window.addEventListener("pointerup", (event) => {
        if (held && !held.hasMoved) {
            select(sliceAt(event.offsetX, event.offsetY));
        }
        held = null;
        picture.classList.remove("dragged");
    });
    window.addEventListener("pointercancel", () => (held = null));
    picture.addEventListener("pointerleave", () => pointAt(-1));
    part("scroller").addEventListener("scroll", redraw);
}

function listen() {
    listenToPicture();
    const clicks = {
        previous: () => choose(state.frame - 1),
        next: () => choose(state.frame + 1),
        closer: () => zoom(ZOOM_STEP),
        farther: () => zoom(1 / ZOOM_STEP),
        fit: fitFrame,
        critical: redraw,
        strip: (event) => choose(frameAt(event.offsetX)),
    };
    Object.entries(clicks).forEach(([id, act]) => part(id).addEventListener("click", act));
    part("chooser").addEventListener("change", (event) => choose(Number(event.target.value)));
    part("search").addEventListener("input", (event) => find(event.target.value));
    const keys = {
        ArrowLeft: () => pan(-0.15),
        ArrowRight: () => pan(0.15),
        ArrowUp: () => (part("scroller").scrollTop -= size.row),
        ArrowDown: () => (part("scroller").scrollTop += size.row),
        "+": () => zoom(ZOOM_STEP),
        "=": () => zoom(ZOOM_STEP),
        "-": () => zoom(1 / ZOOM_STEP),
        "0": fitFrame,
        Escape: () => select(-1),
    };
    window.addEventListener("keydown", (event) => {
        const isTaken = event.target.matches("input[type=search], select, pre");
        const isOthers = event.ctrlKey || event.metaKey || event.altKey;
        if (!isTaken && !isOthers && Object.hasOwn(keys, event.key)) {
            event.preventDefault();
            keys[event.key]();
        }
    });
    new ResizeObserver(resize).observe(part("scroller"));
    window.addEventListener("resize", resize);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
}

Object.assign(wide, measureAll());
fillChooser();
listen();
paint();
select(-1);
// Whoever comes here wonders about a slow frame.
const longest = (one, other, at) => {
    const took = ({ began, ended }) => ended - began;
    return one < 0 || took(other) > took(data.frames[one]) ? at : one;
};
choose(data.frames.reduce(longest, -1));
fitFrame();
