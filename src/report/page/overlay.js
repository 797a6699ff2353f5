
// What is drawn over the lanes and above them: the axis, the critical path, chains, and the strip of all frames.

const AXIS_HEIGHT = 40;
const STRIP_HEIGHT = 42;
// The least distance between two ticks of the axis, and between two frames' numbers, in pixels.
const TICK_DISTANCE = 84;
const NUMBER_DISTANCE = 70;
// The shortest part of the critical path that is drawn in a lane of its own, in pixels.
const SHORTEST_STAY = 6;

// The moment that the axis counts from.
const origin = () => data.frames[state.frame]?.began ?? 0;

function ticks() {
    const least = TICK_DISTANCE / scale();
    const power = 10 ** Math.floor(Math.log10(least));
    const step = Math.max(1, power * [1, 2, 5, 10].find((factor) => factor * power >= least));
    const found = [];
    for (let at = Math.ceil((state.from - origin()) / step); at * step <= state.to - origin(); at += 1) {
        found.push(at * step);
    }
    const [unit, name] = UNITS.find(([unit]) => step >= unit) ?? [1, "ns"];
    return { found, write: (time) => `${Math.round(time / unit)} ${name}` };
}

function drawGrid(context) {
    context.fillStyle = theme.line;
    ticks().found.forEach((time) => context.fillRect(Math.round(xOf(time + origin())), 0, 1, size.height));
}

// Everything outside of the chosen frame steps back, but for what the device does later, and every frame's beginning is marked.
function drawVeil(context) {
    const frame = data.frames[state.frame];
    const device = lanes.find(({ kind }) => kind === "device");
    const height = device ? device.top - size.scrolled : size.height;
    context.fillStyle = theme.ground;
    context.globalAlpha = 0.55;
    if (frame) {
        context.fillRect(0, 0, Math.max(xOf(frame.began), 0), height);
        context.fillRect(xOf(frame.ended), 0, size.width, height);
    }
    context.globalAlpha = 1;
    context.fillStyle = theme.soft;
    bounds().forEach(({ left }) => context.fillRect(left, 0, 1, size.height));
}

// The frames whose beginnings can be seen, of those in one pixel the first.
function bounds() {
    const seen = [];
    data.frames.forEach(({ began }, frame) => {
        const left = Math.round(xOf(began));
        if (left >= GUTTER && left <= size.width && seen.at(-1)?.left !== left) {
            seen.push({ left, frame });
        }
    });
    return seen;
}

function drawAxis() {
    const context = contextOf(part("axis"), size.width, AXIS_HEIGHT);
    context.fillStyle = theme.soft;
    context.textAlign = "left";
    context.fillText("since the frame began", 16, 29);
    const { found, write } = ticks();
    for (const time of found) {
        const x = Math.round(xOf(time + origin()));
        if (x >= GUTTER) {
            context.fillStyle = theme.line;
            context.fillRect(x, 20, 1, AXIS_HEIGHT - 20);
            context.fillStyle = theme.soft;
            context.fillText(x + TICK_DISTANCE / 2 > size.width ? "" : write(time), x + 5, 29);
        }
    }
    let free = -Infinity;
    for (const { left, frame } of bounds()) {
        const isNumbered = left >= free && left + NUMBER_DISTANCE <= size.width;
        const top = isNumbered ? 4 : 20;
        context.fillStyle = theme.soft;
        context.fillRect(left, top, 1, AXIS_HEIGHT - top);
        if (isNumbered) {
            context.fillStyle = frame === state.frame ? theme.ink : theme.soft;
            context.fillText(`frame ${data.frames[frame].number}`, left + 5, 10);
            free = left + NUMBER_DISTANCE;
        }
    }
}

// The critical path as a line: moments, each with the slice beside which it runs. Where it waits it is thin.
function criticalPath() {
    const frame = data.frames[state.frame];
    if (!frame) {
        return [];
    }
    if (!frame.points) {
        const points = [];
        let beside = -1;
        for (let at = 0; at < frame.path.length; at += STEP_NUMBERS) {
            const [group, run, process, worker, ready, waited, took] = frame.path.slice(at, at + STEP_NUMBERS);
            const [began, ended] = [ready + waited, ready + waited + took];
            const found = run < 0 ? spanAt(group, began, ended) : stayAt(run, process, worker, began, ended);
            // The end of a run has no slice to run beside.
            const isWait = found < 0;
            points.push({ moment: ready, beside, isWait: true });
            beside = isWait ? beside : found;
            points.push({ moment: began, beside, isWait: true }, { moment: ended, beside, isWait });
        }
        const known = points.find((point) => point.beside >= 0)?.beside ?? -1;
        points.forEach((point) => (point.beside = point.beside < 0 ? known : point.beside));
        frame.points = known < 0 ? [] : points;
    }
    return frame.points;
}

// The first slice of a worker's stay at a process, if there is one.
function stayAt(run, process, worker, began, ended) {
    const rows = lanes[data.threads.length + worker]?.rows ?? [];
    for (const row of rows) {
        // Half a nanosecond before, as a process without items may take no time.
        for (let at = firstAfter(row, began - 0.5); at < row.length && slices.began[row[at]] <= ended; at += 1) {
            if (isOfRun(row[at]) && slices.run[row[at]] === run && slices.process[row[at]] === process) {
                return row[at];
            }
        }
    }
    return -1;
}

// The span of that name in that time, if there is one.
function spanAt(name, began, ended) {
    for (const lane of lanes.filter((lane) => lane.kind === "thread")) {
        for (const row of lane.rows) {
            for (let at = firstAfter(row, began); at < row.length && slices.began[row[at]] < ended; at += 1) {
                if (slices.process[row[at]] === name) {
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
    // Twice: the ground around the line first, so that it is seen on any colour.
    for (const [color, more] of [[theme.ground, 2.5], [theme.ink, 0]]) {
        context.strokeStyle = color;
        let beside = points[0]?.beside;
        for (let at = 1; at < points.length; at += 1) {
            const [from, to] = [points[at - 1], points[at]];
            const [left, right] = [xOf(from.moment), xOf(to.moment)];
            const previous = beside;
            // A short stay in another lane is seen from near alone: from afar a long path would be nothing but changes.
            beside = right - left < SHORTEST_STAY ? beside : from.beside;
            if (right < 0 || left > size.width) {
                continue;
            }
            context.lineWidth = (to.isWait ? 1 : 2.5) + more;
            context.setLineDash(to.isWait && more === 0 ? [3, 3] : []);
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
    // Above the names.
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

// What the selected slice waited for step by step; fainter what else it needed, and what needed it.
function drawChain(context) {
    const { selected } = state;
    if (!isOfRun(selected)) {
        return;
    }
    const run = runs[slices.run[selected]];
    const { first, last } = factsOf(run);
    const process = slices.process[selected];
    const chain = chainOf(selected);
    context.setLineDash([]);
    context.strokeStyle = context.fillStyle = theme.soft;
    context.lineWidth = 1;
    const others = run.nodes[process].dependencies.filter((other) => last[other] >= 0 && last[other] !== chain[1]);
    others.forEach((other) => drawArrow(context, last[other], selected));
    const dependents = state.dependents.filter((other) => first[other] >= 0);
    dependents.forEach((other) => drawArrow(context, last[process], first[other]));
    context.strokeStyle = context.fillStyle = theme.accent;
    context.lineWidth = 2;
    for (let at = 1; at < chain.length; at += 1) {
        const to = chain[at - 1];
        drawArrow(context, chain[at], to === selected ? to : first[slices.process[to]]);
    }
}

// The index of the frame whose bar stands there.
function frameAt(x) {
    const { bar } = stripOf();
    return Math.min(Math.max(Math.floor((x - 16) / bar), 0), data.frames.length - 1);
}

function stripOf() {
    const width = part("strip").clientWidth;
    return { width, bar: Math.min(18, (width - 32) / Math.max(data.frames.length, 1)) };
}

function drawStrip() {
    const { width, bar } = stripOf();
    const context = contextOf(part("strip"), width, STRIP_HEIGHT);
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
