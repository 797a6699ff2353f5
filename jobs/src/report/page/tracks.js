
// The tracks: layout, colours and drawing.

const GUTTER = 156;
const GAP = 7;
const MIN_ROW_HEIGHT = 15;
const MAX_ROW_HEIGHT = 34;
// The minimum width of a slice with a name, in pixels.
const MIN_NAME_WIDTH = 38;
const FONT = "11px system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";

const byId = (id) => document.getElementById(id);

// What is shown: a time interval, the index of a frame, and slices or −1. `highlighted` has a flag for each node of the selected
// slice's run, `matches` one for each text; `dependents` are the nodes that depend on the selected one.
const state = { from: 0, to: 1, frame: -1, selected: -1, hovered: -1, highlighted: null, dependents: [], matches: null };
const theme = {};
const size = { width: 0, height: 0, row: MAX_ROW_HEIGHT, scrolled: 0 };

// Hue, lightness and chroma in OKLCH. Hues that are close to each other differ in lightness.
const PALETTE = [
    [255, 0.68, 0.13], [85, 0.86, 0.13], [150, 0.82, 0.13], [305, 0.66, 0.15], [210, 0.84, 0.08], [22, 0.68, 0.15],
    [120, 0.72, 0.13], [278, 0.83, 0.08], [52, 0.78, 0.13], [180, 0.68, 0.1], [340, 0.83, 0.09], [65, 0.63, 0.09],
];
const colors = colorsByText();

// A name has the same colour in every log, unless a name before it in the alphabet has taken that.
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
        // With more names than colours, each round over the palette has another lightness.
        if (taken.size === PALETTE.length) {
            taken.clear();
            round += 1;
        }
        let index = hash % PALETTE.length;
        while (taken.has(index)) {
            index = (index + 1) % PALETTE.length;
        }
        taken.add(index);
        return [text, { index, round }];
    };
    return new Map([...ordered].map(pick));
}

function readTheme() {
    const style = getComputedStyle(document.documentElement);
    const names = ["background", "panel", "track", "line", "text", "muted", "accent", "searching", "asleep", "span", "lightness"];
    names.forEach((name) => (theme[name] = style.getPropertyValue(`--${name}`).trim()));
    colors.forEach((color) => {
        const [hue, lightness, chroma] = PALETTE[color.index];
        const light = lightness + Number(theme.lightness) - 0.09 * (color.round % 3);
        color.css = `oklch(${light.toFixed(3)} ${chroma} ${hue})`;
    });
    theme.hatch = hatch();
}

// The fill pattern of searching workers.
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
const xOf = (time) => GUTTER + (time - state.from) * scale();
const timeAt = (x) => state.from + (x - GUTTER) / scale();
const topOf = (slice) => tracks[slices.track[slice]].top + slices.depth[slice] * size.row - size.scrolled;

// Stacks the tracks. The more there are, the lower their rows.
function layOutTracks() {
    const rows = tracks.reduce((sum, track) => sum + Math.max(track.rows.length, 1), 0);
    const available = document.querySelector("main").clientHeight * 0.55 - tracks.length * GAP;
    size.row = Math.min(Math.max(Math.floor(available / rows), MIN_ROW_HEIGHT), MAX_ROW_HEIGHT);
    let top = GAP;
    for (const track of tracks) {
        track.top = top;
        track.height = Math.max(track.rows.length, 1) * size.row;
        top += track.height + GAP;
    }
    byId("spacer").style.height = `${top}px`;
    size.width = byId("scroller").clientWidth;
    size.height = byId("scroller").clientHeight;
    byId("tracks").style.height = `${size.height}px`;
}

// The context of a canvas, cleared and scaled to CSS pixels.
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
    return colors.get(kind === PASS ? slices.node[slice] : nodeOf(slice).color).css;
}

const hasHighlight = () => state.highlighted !== null || state.matches !== null;

function isHighlighted(slice) {
    if (state.highlighted) {
        const isSameRun = isOfRun(slice) && slices.run[slice] === slices.run[state.selected];
        return isSameRun && state.highlighted[slices.node[slice]] === 1;
    }
    return state.matches[isOfRun(slice) ? nodeOf(slice).name : slices.node[slice]] === 1;
}

function drawTracks() {
    const context = contextOf(byId("tracks"), size.width, size.height);
    size.scrolled = byId("scroller").scrollTop;
    const shown = tracks.filter((track) => {
        const top = track.top - size.scrolled;
        return top < size.height && top + track.height > 0;
    });
    context.save();
    context.beginPath();
    context.rect(GUTTER, 0, size.width - GUTTER, size.height);
    context.clip();
    for (const track of shown) {
        const top = track.top - size.scrolled;
        context.fillStyle = theme.track;
        context.fillRect(GUTTER, top, size.width, track.height);
        drawIdle(context, track, top);
    }
    drawGrid(context);
    for (const track of shown) {
        track.rows.forEach((row) => drawRow(context, row));
    }
    dimOtherFrames(context);
    if (byId("critical-path").checked) {
        context.globalAlpha = state.selected >= 0 ? 0.35 : 1;
        drawCriticalPath(context);
        context.globalAlpha = 1;
    }
    if (state.selected >= 0) {
        drawChain(context);
    }
    outline(context, state.selected, theme.accent);
    outline(context, state.hovered, theme.text);
    context.restore();
    shown.forEach((track) => drawLabel(context, track, track.top - size.scrolled));
}

function drawIdle(context, track, top) {
    const { idle } = track;
    let [low, high] = [0, idle.length / IDLE_NUMBERS];
    while (low < high) {
        const middle = (low + high) >> 1;
        const at = middle * IDLE_NUMBERS;
        [low, high] = idle[at + 1] + idle[at + 2] > state.from ? [low, middle] : [middle + 1, high];
    }
    let drawnTo = -Infinity;
    for (let at = low * IDLE_NUMBERS; at < idle.length && idle[at + 1] < state.to; at += IDLE_NUMBERS) {
        const [asleep, began, duration] = [idle[at], idle[at + 1], idle[at + 2]];
        const [left, right] = [Math.max(xOf(began), drawnTo, GUTTER), Math.min(xOf(began + duration), size.width)];
        if (right - left >= 0.5) {
            context.fillStyle = asleep ? theme.asleep : theme.hatch;
            context.fillRect(left, top, right - left, track.height);
            drawnTo = right;
        }
    }
}

function drawRow(context, row) {
    context.globalAlpha = hasHighlight() ? 0.2 : 1;
    // Of slices that end within the same pixel one is enough.
    let drawnTo = state.from;
    for (let at = firstEndingAfter(row, drawnTo); at < row.length && slices.began[row[at]] < state.to; ) {
        drawSlice(context, row[at], !hasHighlight());
        drawnTo = endOfPixel(row[at]);
        at = slices.ended[row[at + 1]] > drawnTo ? at + 1 : Math.max(at + 1, firstEndingAfter(row, drawnTo));
    }
    context.globalAlpha = 1;
    drawnTo = state.from;
    for (let at = hasHighlight() ? firstEndingAfter(row, drawnTo) : row.length; at < row.length; at += 1) {
        const slice = row[at];
        if (slices.began[slice] >= state.to) {
            break;
        }
        if (slices.ended[slice] > drawnTo && isHighlighted(slice)) {
            drawSlice(context, slice, true);
            drawnTo = endOfPixel(slice);
        }
    }
}

// The time at the right edge of the pixel in which a slice ends.
const endOfPixel = (slice) => timeAt(Math.floor(xOf(slices.ended[slice])) + 1);

function drawSlice(context, slice, isNamed) {
    const left = Math.max(xOf(slices.began[slice]), GUTTER - 4);
    const width = Math.min(xOf(slices.ended[slice]), size.width + 4) - left;
    const [top, height] = [topOf(slice), size.row - 1];
    context.fillStyle = cssOf(slice);
    if (slices.kind[slice] === EMPTY) {
        context.fillRect(left, top + height / 3, Math.max(width, 1), height / 3);
        return;
    }
    // A gap of one pixel separates a slice from the next.
    context.fillRect(left, top, width > 3 ? width - 1 : Math.max(width, 1), height);
    if (isNamed && width > MIN_NAME_WIDTH) {
        const from = Math.max(left, GUTTER) + 5;
        const available = left + width - from - 5;
        context.fillStyle = "#15171a";
        context.fillText(truncated(nameOf(slice), Math.floor(available / 6)), from, top + height / 2 + 0.5, available);
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

function drawLabel(context, track, top) {
    const middle = top + Math.min(track.height, size.row) / 2;
    context.fillStyle = theme.text;
    context.textAlign = "left";
    const available = GUTTER - 22 - (track.busy === undefined ? 0 : 34);
    context.fillText(truncated(track.label, 40), 16, middle, available);
    if (track.busy !== undefined) {
        context.fillStyle = theme.muted;
        context.textAlign = "right";
        context.fillText(`${Math.round(track.busy * 100)} %`, GUTTER - 10, middle);
        context.textAlign = "left";
    }
}

// Computes the share of the selected frame in which each worker runs chunks.
function measureBusy() {
    const frame = data.frames[state.frame];
    for (const track of tracks.filter((track) => track.kind === "worker")) {
        let busy = 0;
        const row = frame && track.rows[0] ? track.rows[0] : [];
        const start = frame ? firstEndingAfter(row, frame.began) : 0;
        for (let at = start; at < row.length && slices.began[row[at]] < frame.ended; at += 1) {
            busy += Math.min(slices.ended[row[at]], frame.ended) - Math.max(slices.began[row[at]], frame.began);
        }
        track.busy = frame && frame.ended > frame.began ? busy / (frame.ended - frame.began) : undefined;
    }
}
