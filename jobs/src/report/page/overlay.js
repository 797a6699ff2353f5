
// Drawn over and above the tracks: the axis, the critical path, dependency chains, and the strip of all frames.

const AXIS_HEIGHT = 40;
const STRIP_HEIGHT = 42;
// The minimum distance between two ticks of the axis, and between the numbers of two frames, in pixels.
const MIN_TICK_DISTANCE = 84;
const MIN_NUMBER_DISTANCE = 70;
// Shorter parts of the critical path are drawn on the track of the part before them, in pixels.
const MIN_SPAN_WIDTH = 6;

// The time at the axis' zero.
const origin = () => data.frames[state.frame]?.began ?? 0;

function ticks() {
    const minStep = MIN_TICK_DISTANCE / scale();
    const power = 10 ** Math.floor(Math.log10(minStep));
    const step = Math.max(1, power * [1, 2, 5, 10].find((factor) => factor * power >= minStep));
    const times = [];
    for (let at = Math.ceil((state.from - origin()) / step); at * step <= state.to - origin(); at += 1) {
        times.push(at * step);
    }
    const [unit, name] = UNITS.find(([unit]) => step >= unit) ?? [1, "ns"];
    return { times, format: (time) => `${Math.round(time / unit)} ${name}` };
}

function drawGrid(context) {
    context.fillStyle = theme.line;
    ticks().times.forEach((time) => context.fillRect(Math.round(xOf(time + origin())), 0, 1, size.height));
}

// Dims everything outside of the selected frame except the device's track, which lags behind, and marks where frames begin.
function dimOtherFrames(context) {
    const frame = data.frames[state.frame];
    const device = tracks.find(({ kind }) => kind === "device");
    const height = device ? device.top - size.scrolled : size.height;
    context.fillStyle = theme.background;
    context.globalAlpha = 0.55;
    if (frame) {
        context.fillRect(0, 0, Math.max(xOf(frame.began), 0), height);
        context.fillRect(xOf(frame.ended), 0, size.width, height);
    }
    context.globalAlpha = 1;
    context.fillStyle = theme.muted;
    visibleFrameStarts().forEach(({ left }) => context.fillRect(left, 0, 1, size.height));
}

// The frames whose beginnings are visible. Of several in one pixel the first.
function visibleFrameStarts() {
    const starts = [];
    data.frames.forEach(({ began }, frame) => {
        const left = Math.round(xOf(began));
        if (left >= GUTTER && left <= size.width && starts.at(-1)?.left !== left) {
            starts.push({ left, frame });
        }
    });
    return starts;
}

function drawAxis() {
    const context = contextOf(byId("axis"), size.width, AXIS_HEIGHT);
    context.fillStyle = theme.muted;
    context.textAlign = "left";
    context.fillText("since the frame began", 16, 29);
    const { times, format } = ticks();
    for (const time of times) {
        const x = Math.round(xOf(time + origin()));
        if (x >= GUTTER) {
            context.fillStyle = theme.line;
            context.fillRect(x, 20, 1, AXIS_HEIGHT - 20);
            context.fillStyle = theme.muted;
            context.fillText(x + MIN_TICK_DISTANCE / 2 > size.width ? "" : format(time), x + 5, 29);
        }
    }
    let freeFrom = -Infinity;
    for (const { left, frame } of visibleFrameStarts()) {
        const isNumbered = left >= freeFrom && left + MIN_NUMBER_DISTANCE <= size.width;
        const top = isNumbered ? 4 : 20;
        context.fillStyle = theme.muted;
        context.fillRect(left, top, 1, AXIS_HEIGHT - top);
        if (isNumbered) {
            context.fillStyle = frame === state.frame ? theme.text : theme.muted;
            context.fillText(`frame ${data.frames[frame].number}`, left + 5, 10);
            freeFrom = left + MIN_NUMBER_DISTANCE;
        }
    }
}

// The critical path as a polyline: points in time, each with the slice beside which the line runs. It is thin where it waits.
function criticalPath() {
    const frame = data.frames[state.frame];
    if (!frame) {
        return [];
    }
    if (!frame.points) {
        const points = [];
        let beside = -1;
        for (let at = 0; at < frame.path.length; at += STEP_NUMBERS) {
            const [group, run, node, worker, ready, waited, duration] = frame.path.slice(at, at + STEP_NUMBERS);
            const [began, ended] = [ready + waited, ready + waited + duration];
            const found = run < 0 ? spanAt(group, began, ended) : workerSpanAt(run, node, worker, began, ended);
            // There is no slice at the end of a run.
            const isWait = found < 0;
            points.push({ time: ready, beside, isWait: true });
            beside = isWait ? beside : found;
            points.push({ time: began, beside, isWait: true }, { time: ended, beside, isWait });
        }
        const known = points.find((point) => point.beside >= 0)?.beside ?? -1;
        points.forEach((point) => (point.beside = point.beside < 0 ? known : point.beside));
        frame.points = known < 0 ? [] : points;
    }
    return frame.points;
}

// The first slice of a worker span, or −1.
function workerSpanAt(run, node, worker, began, ended) {
    const rows = tracks[data.threads.length + worker]?.rows ?? [];
    for (const row of rows) {
        // Half a nanosecond earlier, because a node without items may have no duration.
        for (let at = firstEndingAfter(row, began - 0.5); at < row.length && slices.began[row[at]] <= ended; at += 1) {
            if (isOfRun(row[at]) && slices.run[row[at]] === run && slices.node[row[at]] === node) {
                return row[at];
            }
        }
    }
    return -1;
}

// A thread's span of that name in that interval, or −1.
function spanAt(name, began, ended) {
    for (const track of tracks.filter((track) => track.kind === "thread")) {
        for (const row of track.rows) {
            for (let at = firstEndingAfter(row, began); at < row.length && slices.began[row[at]] < ended; at += 1) {
                if (slices.node[row[at]] === name) {
                    return row[at];
                }
            }
        }
    }
    return -1;
}

function drawCriticalPath(context) {
    const points = criticalPath();
    const below = (slice) => topOf(slice) + size.row - 4;
    // Twice: an outline in the background colour first, so that the line is visible on any colour.
    for (const [color, extraWidth] of [[theme.background, 2.5], [theme.text, 0]]) {
        context.strokeStyle = color;
        let beside = points[0]?.beside;
        for (let at = 1; at < points.length; at += 1) {
            const [from, to] = [points[at - 1], points[at]];
            const [left, right] = [xOf(from.time), xOf(to.time)];
            const previous = beside;
            // The line does not change tracks for a short part: zoomed out, a long path would consist of nothing but changes.
            beside = right - left < MIN_SPAN_WIDTH ? beside : from.beside;
            if (right < 0 || left > size.width) {
                continue;
            }
            context.lineWidth = (to.isWait ? 1 : 2.5) + extraWidth;
            context.setLineDash(to.isWait && extraWidth === 0 ? [3, 3] : []);
            context.beginPath();
            context.moveTo(left, below(previous));
            context.lineTo(left, below(beside));
            context.lineTo(right, below(beside));
            context.stroke();
        }
    }
    context.setLineDash([]);
}

function drawArrow(context, from, to) {
    // Above the name of the slice.
    const height = size.row * 0.2;
    const [startX, startY] = [xOf(slices.ended[from]), topOf(from) + height];
    const [endX, endY] = [xOf(slices.began[to]), topOf(to) + height];
    if (Math.max(startX, endX) < 0 || Math.min(startX, endX) > size.width) {
        return;
    }
    const bend = Math.min(Math.max(Math.abs(endX - startX) / 2, 10), 80);
    context.beginPath();
    context.moveTo(startX, startY);
    context.bezierCurveTo(startX + bend, startY, endX - bend, endY, endX - 5, endY);
    context.stroke();
    context.beginPath();
    context.moveTo(endX + 1, endY);
    context.lineTo(endX - 6, endY - 3.5);
    context.lineTo(endX - 6, endY + 3.5);
    context.fill();
}

// The chain of what the selected slice waited for; fainter its other dependencies and its dependents.
function drawChain(context) {
    const { selected } = state;
    if (!isOfRun(selected)) {
        return;
    }
    const run = runs[slices.run[selected]];
    const { first, last } = edgeSlicesOf(run);
    const node = slices.node[selected];
    const chain = chainOf(selected);
    context.setLineDash([]);
    context.strokeStyle = context.fillStyle = theme.muted;
    context.lineWidth = 1;
    const others = run.nodes[node].dependencies.filter((other) => last[other] >= 0 && last[other] !== chain[1]);
    others.forEach((other) => drawArrow(context, last[other], selected));
    const dependents = state.dependents.filter((other) => first[other] >= 0);
    dependents.forEach((other) => drawArrow(context, last[node], first[other]));
    context.strokeStyle = context.fillStyle = theme.accent;
    context.lineWidth = 2;
    for (let at = 1; at < chain.length; at += 1) {
        const to = chain[at - 1];
        drawArrow(context, chain[at], to === selected ? to : first[slices.node[to]]);
    }
}

// The index of the frame whose bar is at `x`.
function frameAt(x) {
    const { bar } = stripLayout();
    return Math.min(Math.max(Math.floor((x - 16) / bar), 0), data.frames.length - 1);
}

function stripLayout() {
    const width = byId("frame-strip").clientWidth;
    return { width, bar: Math.min(18, (width - 32) / Math.max(data.frames.length, 1)) };
}

function drawStrip() {
    const { width, bar } = stripLayout();
    const context = contextOf(byId("frame-strip"), width, STRIP_HEIGHT);
    const longest = data.frames.reduce((longest, { began, ended }) => Math.max(longest, ended - began), 1);
    const draw = ({ began, ended }, frame) => {
        const height = Math.max(1, ((ended - began) / longest) * (STRIP_HEIGHT - 12));
        context.fillRect(16 + frame * bar, STRIP_HEIGHT - 4 - height, Math.max(bar > 3 ? bar - 1 : bar, 1), height);
    };
    context.fillStyle = theme.span;
    data.frames.forEach(draw);
    context.fillStyle = theme.accent;
    data.frames.slice(state.frame, state.frame + 1).forEach((frame) => draw(frame, state.frame));
}
