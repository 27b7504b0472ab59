"use strict";
// Time: the timeline, play and pause, keys, jumps to what was found.

const by = id => document.getElementById(id);
const canvas = by("scene"), timeline = by("timeline");
const state = { time: 0, playing: false, last: 0, waiting: false };
let plots = [];

function setTime(time) {
  state.time = Math.min(longest(), Math.max(0, time));
  if (state.time < range.from || state.time > range.to) slideTo(state.time);
  changed();
}

/** Draws once before the next frame of the screen, however many things changed. */
function changed() {
  if (state.waiting) return;
  state.waiting = true;
  requestAnimationFrame(draw);
}

function draw(now) {
  state.waiting = false;
  if (state.playing) {
    state.time += Math.min(0.2, (now - state.last) / 1000) * Number(by("speed").value);
    state.last = now;
    if (state.time >= longest()) { state.time = longest(); setPlaying(false); } else changed();
    if (state.time > range.to) slideTo(state.time);
  }
  drawScene(canvas, state.time);
  for (const plot of plots) plot.cursor(state.time);
  timeline.value = Math.round(state.time / step());
  timeline.setAttribute("aria-valuetext", `${state.time.toFixed(2)} s`);
  by("clock").textContent = `${state.time.toFixed(2)} of ${longest().toFixed(1)} s`;
  by("marked").textContent = markedLine();
  by("status").textContent = statusLine();
}

/** The first marked part with its reading now; beside a second run also how far that differs. */
function markedLine() {
  const own = plots.filter(plot => plot.guilty.size);
  const torques = view.marks[0] && view.marks[0].kind === "winch" ? /torque/i : /./;
  const plot = own.find(each => torques.test(each.group.title)) || own[0];
  if (!plot) return "";
  const { names, title, unit, parts } = plot.group;
  const i = names.findIndex(name => plot.guilty.has(name));
  const [here, other] = parts.map(({ run, trace }) => valuesAt(run, trace.title, frameAt(run, state.time)));
  if (!here) return "";
  const reading = `${inWords(names[i])}, ${title.toLowerCase()}: ${shortNumber(here[i])} ${unit}`;
  return other ? `${reading}, residual ${shortNumber(here[i] - other[i])} ${unit}` : reading;
}

const step = () => view.runs[0].period;

/** What is to be read at this instant: tensions, and which cables are slack. */
function statusLine() {
  const run = view.runs[0], frame = frameAt(run, state.time);
  const tensions = valuesAt(run, tensionTitle, frame);
  if (!tensions) return "";
  const slack = machine.cables.filter((cable, i) => cable.exit && tensions[i] <= machine.slack);
  const names = slack.length ? `slack: ${slack.map(cable => inWords(cable.name)).join(", ")}` : "no cable slack";
  return `tensions ${shortNumber(Math.min(...tensions))} to ${shortNumber(Math.max(...tensions))} N, ${names}`;
}

function setPlaying(playing) {
  if (playing && state.time >= longest()) state.time = 0;
  state.playing = playing;
  state.last = performance.now();
  by("play").textContent = playing ? "❚❚" : "▶";
  changed();
}

/** Shows a stretch of time in all plots. */
function show(from, to) {
  range.from = Math.max(0, from);
  range.to = Math.max(range.from + 2 * step(), Math.min(longest(), to));
  for (const plot of plots) plot.redraw();
  changed();
}

function slideTo(time) {
  const wide = range.to - range.from;
  show(Math.max(0, Math.min(time - 0.1 * wide, longest() - wide)), Math.max(0, Math.min(time - 0.1 * wide, longest() - wide)) + wide);
}

function zoomTime(factor) {
  const wide = Math.min(longest(), factor * (range.to - range.from));
  const from = Math.max(0, Math.min(state.time - 0.5 * wide, longest() - wide));
  show(from, from + wide);
}

function fit() {
  fitCamera(extent());
  changed();
}

function jump(mark) {
  const time = mark.at === null ? state.time : mark.at;
  show(Math.max(0, time - 2), Math.max(0, time - 2) + 4);
  setTime(time);
}

function addJumps() {
  const timed = view.marks.filter((mark, i) =>
    mark.at !== null && view.marks.findIndex(other => other.at === mark.at) === i);
  for (const mark of timed) {
    const button = document.createElement("button");
    button.textContent = `Where it shows: ${mark.words}, ${mark.at.toFixed(1)} s`;
    button.addEventListener("click", () => jump(mark));
    by("jumps").append(button);
  }
  return timed;
}

function addLegend() {
  const part = (swatch, text) => {
    const line = document.createElement("span");
    line.append(swatch, text);
    by("legend").append(line);
  };
  const piece = (kind, style) => Object.assign(document.createElement("span"), { className: kind, style });
  by("legend").textContent = "";
  view.runs.forEach((run, i) => part(piece("swatch", `border-color: ${colourOfRun(i)}`),
    i ? `${run.name} (dashed in plots)` : run.name));
  if (view.runs.some(run => run.traces.some(trace => trace.title === tensionTitle))) {
    part(piece("ramp", `background: ${rampCss()}`), `tension 0 to ${shortNumber(most)} N`);
    part(piece("swatch", "border-top-style: dashed"), "slack cable");
  }
  if (view.runs.some(run => run.poses.wanted)) part(piece("swatch", "border-top-width: 1px"), "thin box: wanted pose of the bar");
  if (view.runs.some(run => run.poses.target)) part("", "plate: target");
}

const KEYS = {
  " ": () => setPlaying(!state.playing),
  ArrowLeft: event => setTime(state.time - (event.shiftKey ? 1 : step())),
  ArrowRight: event => setTime(state.time + (event.shiftKey ? 1 : step())),
  Home: () => setTime(0),
  End: () => setTime(longest()),
  "+": () => zoomTime(0.5),
  "-": () => zoomTime(2),
  f: fit,
  a: () => { turn(0.1, 0); changed(); },
  d: () => { turn(-0.1, 0); changed(); },
  w: () => { turn(0, 0.1); changed(); },
  s: () => { turn(0, -0.1); changed(); },
  j: () => { const next = view.marks.find(mark => mark.at !== null); if (next) jump(next); },
};

function attachKeys() {
  document.addEventListener("keydown", event => {
    const typing = event.target.matches("select, input:not([type=range])");
    const pressing = event.key === " " && event.target.matches("button");
    if (typing || pressing || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key](event);
  });
}

function sized() {
  timeline.max = Math.round(longest() / step());
}

function begin() {
  by("title").textContent = `${view.title} on ${view.machine.name}`;
  const statements = [...new Set(view.marks.map(mark => mark.statement))];
  by("finding").textContent = statements.join(" ");
  by("finding").hidden = !statements.length;
  plots = groups().map(group => new Plot(group, by("plots"), setTime));
  // What is about the marked part comes first.
  for (const plot of plots.filter(each => each.guilty.size).reverse()) by("plots").prepend(plot.canvas.parentNode);
  for (const button of document.querySelectorAll("#views button")) {
    button.addEventListener("click", () => {
      const angles = VIEWS[button.dataset.view];
      if (angles) [camera.azimuth, camera.elevation] = angles; else fit();
      changed();
    });
  }
  by("play").addEventListener("click", () => setPlaying(!state.playing));
  by("in").addEventListener("click", () => zoomTime(0.5));
  by("out").addEventListener("click", () => zoomTime(2));
  timeline.addEventListener("input", () => setTime(Number(timeline.value) * step()));
  attachCamera(canvas, changed);
  attachKeys();
  // At once, since a browser stretches the old picture until the new one is there.
  const again = () => { for (const plot of plots) plot.redraw(); draw(performance.now()); };
  const watch = new ResizeObserver(again);
  for (const each of [canvas, ...plots.map(plot => plot.canvas)]) watch.observe(each);
  dark.addEventListener("change", () => { addLegend(); again(); });
  sized();
  fit();
  show(0, longest());
  addLegend();
  const timed = addJumps();
  if (timed.length) jump(timed[0]);
}

begin();
