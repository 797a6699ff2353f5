"use strict";

// The log as the page uses it: slices on tracks, and what each waited for. Points in time and durations are in nanoseconds.

const data = JSON.parse(document.getElementById("data").textContent);

const CHUNK = 0;
const EMPTY = 1;
const SPAN = 2;
const PASS = 3;

const CHUNK_NUMBERS = 8;
const SPAN_NUMBERS = 5;
const PASS_NUMBERS = 5;
const STEP_NUMBERS = 7;
const IDLE_NUMBERS = 3;

// Everything that is drawn on tracks, as a structure of arrays: objects would take ten times the memory.
const slices = columnsFor(countSlices());
const tracks = [];
const runs = data.runs.map((run) => ({ ...run, nodes: data.graphs[run.graph], from: 0, to: 0, edgeSlices: null }));

function countSlices() {
    const ofRuns = data.runs.reduce((sum, run) => sum + run.chunks.length + run.empty.length, 0) / CHUNK_NUMBERS;
    const passes = data.device ? data.device.passes.length / PASS_NUMBERS : 0;
    return ofRuns + data.spans.length / SPAN_NUMBERS + passes;
}

function columnsFor(count) {
    const times = () => new Float64Array(count);
    const numbers = () => new Int32Array(count);
    return {
        count: 0,
        kind: new Uint8Array(count),
        stolen: new Uint8Array(count),
        began: times(),
        ended: times(),
        opened: times(),
        first: times(),
        items: times(),
        track: numbers(),
        depth: numbers(),
        // Of a chunk its run and node. Of a span or a pass the texts of its view and name.
        run: numbers(),
        node: numbers(),
        frame: times(),
    };
}

function addSlice(kind, track, frame, began, duration, others) {
    const slice = slices.count++;
    Object.entries(others).forEach(([column, value]) => (slices[column][slice] = value));
    slices.kind[slice] = kind;
    slices.track[slice] = track;
    slices.frame[slice] = frame;
    slices.began[slice] = began;
    slices.ended[slice] = began + Math.max(duration, 0);
    tracks[track].slices.push(slice);
}

function addTrack(kind, label, idle = []) {
    tracks.push({ kind, label, idle, slices: [], rows: [] });
}

function addChunks(kind, chunks, run, firstWorker) {
    for (let at = 0; at < chunks.length; at += CHUNK_NUMBERS) {
        const [node, first, items, worker, stolen, opened, waited, duration] = chunks.slice(at, at + CHUNK_NUMBERS);
        const others = { run, node, first, items, stolen, opened };
        addSlice(kind, firstWorker + worker, runs[run].frame, opened + waited, duration, others);
    }
}

function readLog() {
    data.threads.forEach((name) => addTrack("thread", data.texts[name]));
    data.workers.forEach((worker) => addTrack("worker", data.texts[worker.name], worker.idle));
    runs.forEach((run, index) => {
        run.from = slices.count;
        addChunks(CHUNK, run.chunks, index, data.threads.length);
        addChunks(EMPTY, run.empty, index, data.threads.length);
        run.to = slices.count;
    });
    for (let at = 0; at < data.spans.length; at += SPAN_NUMBERS) {
        const [node, thread, frame, began, duration] = data.spans.slice(at, at + SPAN_NUMBERS);
        addSlice(SPAN, thread, frame, began, duration, { node });
    }
    if (data.device) {
        const { name, error, passes } = data.device;
        addTrack("device", `${data.texts[name]} ±${formatDuration(error)}`);
        for (let at = 0; at < passes.length; at += PASS_NUMBERS) {
            const [node, run, frame, began, duration] = passes.slice(at, at + PASS_NUMBERS);
            addSlice(PASS, tracks.length - 1, frame, began, duration, { node, run });
        }
    }
    tracks.forEach(fillRows);
}

// Divides a track into rows of slices that do not overlap, ascending. A slice inside another one is a row deeper.
function fillRows(track) {
    const { began, ended, depth } = slices;
    // Of slices that begin at once the longer one contains the shorter. A slice of no duration comes before both.
    const isLong = (slice) => (ended[slice] > began[slice] ? 1 : 0);
    const compare = (one, other) =>
        began[one] - began[other] || isLong(one) - isLong(other) || ended[other] - ended[one];
    track.slices.sort(compare);
    const until = [];
    for (const slice of track.slices) {
        let row = until.length;
        while (row > 0 && until[row - 1] <= began[slice]) {
            row -= 1;
        }
        until.length = row;
        until.push(ended[slice]);
        depth[slice] = row;
        (track.rows[row] ??= []).push(slice);
    }
    track.rows = track.rows.map((row) => Int32Array.from(row));
    track.slices = null;
}

// The index of the first slice of a row that ends after `time`.
function firstEndingAfter(row, time) {
    let [low, high] = [0, row.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (slices.ended[row[middle]] > time) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

const isOfRun = (slice) => slices.kind[slice] <= EMPTY;
const nodeOf = (slice) => runs[slices.run[slice]].nodes[slices.node[slice]];
const nameOf = (slice) => data.texts[isOfRun(slice) ? nodeOf(slice).name : slices.node[slice]];

// For each node of a run the slice that began first and the one that ended last, or −1 if it never ran.
function edgeSlicesOf(run) {
    if (!run.edgeSlices) {
        const first = new Int32Array(run.nodes.length).fill(-1);
        const last = new Int32Array(run.nodes.length).fill(-1);
        for (let slice = run.from; slice < run.to; slice += 1) {
            const node = slices.node[slice];
            if (first[node] < 0 || slices.began[slice] < slices.began[first[node]]) {
                first[node] = slice;
            }
            if (last[node] < 0 || slices.ended[slice] > slices.ended[last[node]]) {
                last[node] = slice;
            }
        }
        run.edgeSlices = { first, last };
    }
    return run.edgeSlices;
}

// The last slice of the dependency that ended last, or −1 if the node has no dependencies.
function lastDependencyOf(run, node) {
    const { last } = edgeSlicesOf(run);
    const ends = run.nodes[node].dependencies.map((dependency) => last[dependency]).filter((slice) => slice >= 0);
    return ends.reduce((latest, slice) => (latest < 0 || slices.ended[slice] > slices.ended[latest] ? slice : latest), -1);
}

// When all dependencies of a slice's node were done.
function readyAt(slice) {
    const run = runs[slices.run[slice]];
    const dependency = lastDependencyOf(run, slices.node[slice]);
    return dependency < 0 ? run.began : slices.ended[dependency];
}

// A slice, the slice that it waited for last, the slice that this one waited for last, and so on to the start of the run.
function chainOf(slice) {
    const chain = [slice];
    for (let at = slice; (at = lastDependencyOf(runs[slices.run[at]], slices.node[at])) >= 0; ) {
        chain.push(at);
    }
    return chain;
}

// The node of a slice and all its direct and indirect dependencies, as a flag for each node.
function predecessorsOf(slice) {
    const { nodes } = runs[slices.run[slice]];
    const found = new Uint8Array(nodes.length);
    found[slices.node[slice]] = 1;
    // Nodes are in topological order, so one pass backwards is enough.
    for (let node = slices.node[slice]; node >= 0; node -= 1) {
        if (found[node]) {
            nodes[node].dependencies.forEach((dependency) => (found[dependency] = 1));
        }
    }
    return found;
}

const UNITS = [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]];

// Formats a duration with three digits, in the largest unit that is not longer.
function formatDuration(time) {
    const [unit, name] = UNITS.find(([unit]) => Math.abs(time) >= unit) ?? [1, "ns"];
    const digits = unit === 1 ? 0 : Math.max(0, 2 - Math.floor(Math.log10(Math.abs(time) / unit)));
    return `${(time / unit).toFixed(digits)} ${name}`;
}

function truncated(text, max) {
    return text.length > max ? `${text.slice(0, max - 1)}…` : text;
}

readLog();
