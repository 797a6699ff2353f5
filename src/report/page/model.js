"use strict";

// The log as the page works with it: slices in lanes, and what each waited for. Moments and lengths are in nanoseconds.

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

// All that is drawn in lanes, a column for each of its numbers: objects would take ten times the memory.
const slices = columnsFor(countSlices());
const lanes = [];
const runs = data.runs.map((run) => ({ ...run, nodes: data.graphs[run.graph], from: 0, to: 0, facts: null }));

function countSlices() {
    const ofRuns = data.runs.reduce((sum, run) => sum + run.chunks.length + run.empty.length, 0) / CHUNK_NUMBERS;
    const passes = data.device ? data.device.passes.length / PASS_NUMBERS : 0;
    return ofRuns + data.spans.length / SPAN_NUMBERS + passes;
}

function columnsFor(count) {
    const moments = () => new Float64Array(count);
    const numbers = () => new Int32Array(count);
    return {
        count: 0,
        kind: new Uint8Array(count),
        stolen: new Uint8Array(count),
        began: moments(),
        ended: moments(),
        opened: moments(),
        first: moments(),
        items: moments(),
        lane: numbers(),
        depth: numbers(),
        // Of a chunk its run and process; of the others the texts for their name and view.
        run: numbers(),
        process: numbers(),
        frame: moments(),
    };
}

function addSlice(kind, lane, frame, began, took, others) {
    const slice = slices.count++;
    Object.entries(others).forEach(([column, value]) => (slices[column][slice] = value));
    slices.kind[slice] = kind;
    slices.lane[slice] = lane;
    slices.frame[slice] = frame;
    slices.began[slice] = began;
    slices.ended[slice] = began + Math.max(took, 0);
    lanes[lane].slices.push(slice);
}

function addLane(kind, label, idle = []) {
    lanes.push({ kind, label, idle, slices: [], rows: [] });
}

function addChunks(kind, chunks, run, firstWorker) {
    for (let at = 0; at < chunks.length; at += CHUNK_NUMBERS) {
        const [process, first, items, worker, stolen, opened, waited, took] = chunks.slice(at, at + CHUNK_NUMBERS);
        const others = { run, process, first, items, stolen, opened };
        addSlice(kind, firstWorker + worker, runs[run].frame, opened + waited, took, others);
    }
}

function readLog() {
    data.threads.forEach((name) => addLane("thread", data.texts[name]));
    data.workers.forEach((worker) => addLane("worker", data.texts[worker.name], worker.idle));
    runs.forEach((run, index) => {
        run.from = slices.count;
        addChunks(CHUNK, run.chunks, index, data.threads.length);
        addChunks(EMPTY, run.empty, index, data.threads.length);
        run.to = slices.count;
    });
    for (let at = 0; at < data.spans.length; at += SPAN_NUMBERS) {
        const [process, thread, frame, began, took] = data.spans.slice(at, at + SPAN_NUMBERS);
        addSlice(SPAN, thread, frame, began, took, { process });
    }
    if (data.device) {
        const { name, error, passes } = data.device;
        addLane("device", `${data.texts[name]} ±${inWords(error)}`);
        for (let at = 0; at < passes.length; at += PASS_NUMBERS) {
            const [process, run, frame, began, took] = passes.slice(at, at + PASS_NUMBERS);
            addSlice(PASS, lanes.length - 1, frame, began, took, { process, run });
        }
    }
    lanes.forEach(fillRows);
}

// Rows of slices that do not overlap, ascending. What goes on inside of another slice is a row deeper.
function fillRows(lane) {
    const { began, ended, depth } = slices;
    // Of those that begin at once the longer holds the shorter; but one that takes no time comes before both.
    const isLong = (slice) => (ended[slice] > began[slice] ? 1 : 0);
    const compare = (one, other) =>
        began[one] - began[other] || isLong(one) - isLong(other) || ended[other] - ended[one];
    lane.slices.sort(compare);
    const until = [];
    for (const slice of lane.slices) {
        let row = until.length;
        while (row > 0 && until[row - 1] <= began[slice]) {
            row -= 1;
        }
        until.length = row;
        until.push(ended[slice]);
        depth[slice] = row;
        (lane.rows[row] ??= []).push(slice);
    }
    lane.rows = lane.rows.map((row) => Int32Array.from(row));
    lane.slices = null;
}

// The place of the first slice of a row that has not ended by then.
function firstAfter(row, moment) {
    let [low, high] = [0, row.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (slices.ended[row[middle]] > moment) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

const isOfRun = (slice) => slices.kind[slice] <= EMPTY;
const nodeOf = (slice) => runs[slices.run[slice]].nodes[slices.process[slice]];
const nameOf = (slice) => data.texts[isOfRun(slice) ? nodeOf(slice).name : slices.process[slice]];

// Of every process of a run the slice that began first and the one that ended last; −1 where it never ran.
function factsOf(run) {
    if (!run.facts) {
        const first = new Int32Array(run.nodes.length).fill(-1);
        const last = new Int32Array(run.nodes.length).fill(-1);
        for (let slice = run.from; slice < run.to; slice += 1) {
            const process = slices.process[slice];
            if (first[process] < 0 || slices.began[slice] < slices.began[first[process]]) {
                first[process] = slice;
            }
            if (last[process] < 0 || slices.ended[slice] > slices.ended[last[process]]) {
                last[process] = slice;
            }
        }
        run.facts = { first, last };
    }
    return run.facts;
}

// The slice that a process waited for: the end of the dependency that ended last. −1 for one that waits for none.
function awaitedBy(run, process) {
    const { last } = factsOf(run);
    const ends = run.nodes[process].dependencies.map((dependency) => last[dependency]).filter((slice) => slice >= 0);
    return ends.reduce((latest, slice) => (latest < 0 || slices.ended[slice] > slices.ended[latest] ? slice : latest), -1);
}

// When all that a slice's process depends on was done.
function readyAt(slice) {
    const run = runs[slices.run[slice]];
    const awaited = awaitedBy(run, slices.process[slice]);
    return awaited < 0 ? run.began : slices.ended[awaited];
}

// What a slice waited for, what that waited for, and so on to the beginning of the run.
function chainOf(slice) {
    const chain = [slice];
    for (let at = slice; (at = awaitedBy(runs[slices.run[at]], slices.process[at])) >= 0; ) {
        chain.push(at);
    }
    return chain;
}

// Which processes of its run must have ended before a slice could begin, and its own.
function predecessorsOf(slice) {
    const { nodes } = runs[slices.run[slice]];
    const found = new Uint8Array(nodes.length);
    found[slices.process[slice]] = 1;
    // Each comes after all it waits for, so once backwards is enough.
    for (let process = slices.process[slice]; process >= 0; process -= 1) {
        if (found[process]) {
            nodes[process].dependencies.forEach((dependency) => (found[dependency] = 1));
        }
    }
    return found;
}

const UNITS = [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]];

// A length of time, in the unit in which it is not less than one.
function inWords(time) {
    const [unit, name] = UNITS.find(([unit]) => Math.abs(time) >= unit) ?? [1, "ns"];
    const digits = unit === 1 ? 0 : Math.max(0, 2 - Math.floor(Math.log10(Math.abs(time) / unit)));
    return `${(time / unit).toFixed(digits)} ${name}`;
}

function shortened(text, most) {
    return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

readLog();
