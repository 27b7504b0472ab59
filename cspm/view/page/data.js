"use strict";
// What the page carries: a head as JSON, and behind it all numbers as little-endian floats.

const view = JSON.parse(document.getElementById("view").textContent);

function readNumbers(packed) {
  const text = atob(packed.trim());
  const bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

/** Gives each run its arrays, row by row of its frames. */
function unpack(runs, numbers) {
  let at = 0;
  const take = size => numbers.slice(at, at += size);
  for (const run of runs) {
    run.poses = Object.fromEntries(run.poses.map(body => [body, take(6 * run.count)]));
    for (const trace of run.traces) {
      trace.low = take(trace.names.length * run.count);
      trace.high = take(trace.names.length * run.count);
    }
  }
}

unpack(view.runs, readNumbers(document.getElementById("numbers").textContent));

/** Seconds that a run lasts. */
const duration = run => Math.max(0, run.count - 1) * run.period;
const longest = () => Math.max(...view.runs.map(duration));
/** The frame of a run at a time [s], -1 beyond its ends. */
function frameAt(run, time) {
  const frame = Math.round(time / run.period);
  return frame >= 0 && frame < run.count ? frame : -1;
}

/** A body's pose x y z φ θ ψ at a frame, or null where it is not known. */
function poseAt(run, body, frame) {
  const rows = run.poses[body];
  if (!rows || frame < 0) return null;
  const pose = rows.subarray(6 * frame, 6 * frame + 6);
  return Number.isNaN(pose[0]) ? null : pose;
}

/** The middle of a trace's values at a frame, one per name; null where it is not recorded. */
function valuesAt(run, title, frame) {
  const trace = run.traces.find(each => each.title === title);
  if (!trace || frame < 0) return null;
  const width = trace.names.length;
  return trace.names.map((_, i) => {
    const k = width * frame + i;
    return 0.5 * (trace.low[k] + trace.high[k]);
  });
}

const inWords = name => name.replaceAll("_", " ");
