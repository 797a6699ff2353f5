
// The lanes: what is where on the canvas, and in which colour.

const GUTTER = 156;
const GAP = 7;
const LOWEST_ROW = 15;
const HIGHEST_ROW = 34;
// The narrowest that a slice's name is written in, in pixels.
const NARROWEST_NAME = 38;
const FONT = "11px system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";

const part = (id) => document.getElementById(id);

// What is shown: a stretch of time, the index of a frame, and slices or −1. `lit` and `found` say what stands out, by
// process of the selected slice's run and by text; `dependents` are the processes that wait for the selected one.
const state = { from: 0, to: 1, frame: -1, selected: -1, hovered: -1, lit: null, dependents: [], found: null };
const theme = {};
const size = { width: 0, height: 0, row: HIGHEST_ROW, scrolled: 0 };

// Hue, lightness and chroma in OKLCH. What is near on the circle is far in lightness.
const PALETTE = [
    [255, 0.68, 0.13], [85, 0.86, 0.13], [150, 0.82, 0.13], [305, 0.66, 0.15], [210, 0.84, 0.08], [22, 0.68, 0.15],
    [120, 0.72, 0.13], [278, 0.83, 0.08], [52, 0.78, 0.13], [180, 0.68, 0.1], [340, 0.83, 0.09], [65, 0.63, 0.09],
];
const colors = colorsByText();

// A name has the same colour in every log, unless another one that comes before it in the alphabet has taken it.
function colorsByText() {
    const name = (text) => data.texts[text];
    const inOrder = (texts) => [...new Set(texts)].sort((one, other) => (name(one) < name(other) ? -1 : 1));
    const passes = data.device ? data.device.passes.filter((_, at) => at % PASS_NUMBERS === 0) : [];
    const stages = data.graphs.flatMap((nodes) => nodes.map((node) => node.color));
    const ordered = new Set([...inOrder(stages), ...inOrder(passes)]);
    const taken = new Set();
    let round = 0;
    const pick = (text) => {
        let hash = 0x811c9dc5;
        for (const letter of name(text).slice(0, 200)) {
            hash = Math.imul(hash ^ letter.codePointAt(0), 0x01000193) >>> 0;
        }
        // Those of which there are more than colours are told apart by how light they are.
        if (taken.size === PALETTE.length) {
            taken.clear();
            round += 1;
        }
        let place = hash % PALETTE.length;
        while (taken.has(place)) {
            place = (place + 1) % PALETTE.length;
        }
        taken.add(place);
        return [text, { place, round }];
    };
    return new Map([...ordered].map(pick));
}

function readTheme() {
    const style = getComputedStyle(document.documentElement);
    const names = ["ground", "panel", "lane", "line", "ink", "soft", "accent", "searching", "asleep", "span", "lightness"];
    names.forEach((name) => (theme[name] = style.getPropertyValue(`--${name}`).trim()));
    colors.forEach((color) => {
        const [hue, lightness, chroma] = PALETTE[color.place];
        const light = lightness + Number(theme.lightness) - 0.09 * (color.round % 3);
        color.css = `oklch(${light.toFixed(3)} ${chroma} ${hue})`;
    });
    theme.hatch = hatch();
}

// The pattern of a worker that searches.
function hatch() {
    const tile = document.createElement("canvas");
    tile.width = tile.height = 6;
    const context = tile.getContext("2d");
    context.strokeStyle = theme.searching;
    for (const shift of [-6, 0, 6]) {
        context.moveTo(shift - 1, 7);
        context.lineTo(shift + 7, -1);
    }
    context.stroke();
    return context.createPattern(tile, "repeat");
}

const scale = () => (size.width - GUTTER) / (state.to - state.from);
const xOf = (moment) => GUTTER + (moment - state.from) * scale();
const momentAt = (x) => state.from + (x - GUTTER) / scale();
const topOf = (slice) => lanes[slices.lane[slice]].top + slices.depth[slice] * size.row - size.scrolled;

// Places the lanes one below another, the lower the more there are.
function layOut() {
    const rows = lanes.reduce((sum, lane) => sum + Math.max(lane.rows.length, 1), 0);
    const room = document.querySelector("main").clientHeight * 0.55 - lanes.length * GAP;
    size.row = Math.min(Math.max(Math.floor(room / rows), LOWEST_ROW), HIGHEST_ROW);
    let top = GAP;
    for (const lane of lanes) {
        lane.top = top;
        lane.height = Math.max(lane.rows.length, 1) * size.row;
        top += lane.height + GAP;
    }
    part("spacer").style.height = `${top}px`;
    size.width = part("scroller").clientWidth;
    size.height = part("scroller").clientHeight;
    part("picture").style.height = `${size.height}px`;
}

// A canvas's context, cleared, in which a pixel is one of the page's.
function contextOf(canvas, width, height) {
    const density = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * density);
    canvas.height = Math.round(height * density);
    canvas.style.width = `${width}px`;
    const context = canvas.getContext("2d");
    context.scale(density, density);
    context.font = FONT;
    context.textBaseline = "middle";
    return context;
}

function cssOf(slice) {
    const kind = slices.kind[slice];
    if (kind === SPAN) {
        return theme.span;
    }
    return colors.get(kind === PASS ? slices.process[slice] : nodeOf(slice).color).css;
}

const picksOut = () => state.lit !== null || state.found !== null;

function isLit(slice) {
    if (state.lit) {
        const isNear = isOfRun(slice) && slices.run[slice] === slices.run[state.selected];
        return isNear && state.lit[slices.process[slice]] === 1;
    }
    return state.found[isOfRun(slice) ? nodeOf(slice).name : slices.process[slice]] === 1;
}

function drawLanes() {
    const context = contextOf(part("picture"), size.width, size.height);
    size.scrolled = part("scroller").scrollTop;
    const shown = lanes.filter((lane) => {
        const top = lane.top - size.scrolled;
        return top < size.height && top + lane.height > 0;
    });
    context.save();
    context.beginPath();
    context.rect(GUTTER, 0, size.width - GUTTER, size.height);
    context.clip();
    for (const lane of shown) {
        const top = lane.top - size.scrolled;
        context.fillStyle = theme.lane;
        context.fillRect(GUTTER, top, size.width, lane.height);
        drawIdle(context, lane, top);
    }
    drawGrid(context);
    for (const lane of shown) {
        lane.rows.forEach((row) => drawRow(context, row));
    }
    drawVeil(context);
    if (part("critical").checked) {
        context.globalAlpha = state.selected >= 0 ? 0.35 : 1;
        drawCriticalPath(context);
        context.globalAlpha = 1;
    }
    if (state.selected >= 0) {
        drawChain(context);
    }
    outline(context, state.selected, theme.accent);
    outline(context, state.hovered, theme.ink);
    context.restore();
    shown.forEach((lane) => drawLabel(context, lane, lane.top - size.scrolled));
}

function drawIdle(context, lane, top) {
    const { idle } = lane;
    let [low, high] = [0, idle.length / IDLE_NUMBERS];
    while (low < high) {
        const middle = (low + high) >> 1;
        const at = middle * IDLE_NUMBERS;
        [low, high] = idle[at + 1] + idle[at + 2] > state.from ? [low, middle] : [middle + 1, high];
    }
    let drawnTo = -Infinity;
    for (let at = low * IDLE_NUMBERS; at < idle.length && idle[at + 1] < state.to; at += IDLE_NUMBERS) {
        const [asleep, began, took] = [idle[at], idle[at + 1], idle[at + 2]];
        const [left, right] = [Math.max(xOf(began), drawnTo, GUTTER), Math.min(xOf(began + took), size.width)];
        if (right - left >= 0.5) {
            context.fillStyle = asleep ? theme.asleep : theme.hatch;
            context.fillRect(left, top, right - left, lane.height);
            drawnTo = right;
        }
    }
}

function drawRow(context, row) {
    context.globalAlpha = picksOut() ? 0.2 : 1;
    // Of all that end within the same pixel one is enough.
    let drawnTo = state.from;
    for (let at = firstAfter(row, drawnTo); at < row.length && slices.began[row[at]] < state.to; ) {
        drawSlice(context, row[at], !picksOut());
        drawnTo = endOfPixel(row[at]);
        at = slices.ended[row[at + 1]] > drawnTo ? at + 1 : Math.max(at + 1, firstAfter(row, drawnTo));
    }
    context.globalAlpha = 1;
    drawnTo = state.from;
    for (let at = picksOut() ? firstAfter(row, drawnTo) : row.length; at < row.length; at += 1) {
        const slice = row[at];
        if (slices.began[slice] >= state.to) {
            break;
        }
        if (slices.ended[slice] > drawnTo && isLit(slice)) {
            drawSlice(context, slice, true);
            drawnTo = endOfPixel(slice);
        }
    }
}

// Until when the pixel goes in which a slice ends.
const endOfPixel = (slice) => momentAt(Math.floor(xOf(slices.ended[slice])) + 1);

function drawSlice(context, slice, isNamed) {
    const left = Math.max(xOf(slices.began[slice]), GUTTER - 4);
    const width = Math.min(xOf(slices.ended[slice]), size.width + 4) - left;
    const [top, height] = [topOf(slice), size.row - 1];
    context.fillStyle = cssOf(slice);
    if (slices.kind[slice] === EMPTY) {
        context.fillRect(left, top + height / 3, Math.max(width, 1), height / 3);
        return;
    }
    // A pixel of the ground tells a slice from the next.
    context.fillRect(left, top, width > 3 ? width - 1 : Math.max(width, 1), height);
    if (isNamed && width > NARROWEST_NAME) {
        const from = Math.max(left, GUTTER) + 5;
        const room = left + width - from - 5;
        context.fillStyle = "#15171a";
        context.fillText(shortened(nameOf(slice), Math.floor(room / 6)), from, top + height / 2 + 0.5, room);
    }
}

function outline(context, slice, color) {
    if (slice >= 0) {
        const left = Math.max(xOf(slices.began[slice]), -4);
        const right = Math.min(xOf(slices.ended[slice]), size.width + 4);
        context.strokeStyle = color;
        context.lineWidth = 2;
        context.strokeRect(left, topOf(slice), Math.max(right - left - 1, 1), size.row - 1);
    }
}

function drawLabel(context, lane, top) {
    const middle = top + Math.min(lane.height, size.row) / 2;
    context.fillStyle = theme.ink;
    context.textAlign = "left";
    const room = GUTTER - 22 - (lane.busy === undefined ? 0 : 34);
    context.fillText(shortened(lane.label, 40), 16, middle, room);
    if (lane.busy !== undefined) {
        context.fillStyle = theme.soft;
        context.textAlign = "right";
        context.fillText(`${Math.round(lane.busy * 100)} %`, GUTTER - 10, middle);
        context.textAlign = "left";
    }
}

// What share of the chosen frame each worker is busy with chunks.
function measureBusy() {
    const frame = data.frames[state.frame];
    for (const lane of lanes.filter((lane) => lane.kind === "worker")) {
        let busy = 0;
        const row = frame && lane.rows[0] ? lane.rows[0] : [];
        const start = frame ? firstAfter(row, frame.began) : 0;
        for (let at = start; at < row.length && slices.began[row[at]] < frame.ended; at += 1) {
            busy += Math.min(slices.ended[row[at]], frame.ended) - Math.max(slices.began[row[at]], frame.began);
        }
        lane.busy = frame && frame.ended > frame.began ? busy / (frame.ended - frame.began) : undefined;
    }
}
