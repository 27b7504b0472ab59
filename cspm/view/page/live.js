"use strict";
// A run as it happens: what came since, pause, and knobs that begin the run again.

const ASK_MS = 400;
const live = { version: "", following: true, knobs: null, gone: false };

async function ask() {
  try {
    const answer = await fetch(`/run?after=${encodeURIComponent(live.version)}`);
    if (answer.status === 200) take(await answer.json());
    live.gone = false;
  } catch {
    live.gone = true;
  }
  showState();
  setTimeout(ask, ASK_MS);
}

/** Puts what came in the place of what was there; the plots keep their lines. */
function take(data) {
  live.version = data.version;
  live.state = data.state;
  if (data.runs.length) {
    const [old, fresh] = [view.runs[0], data.runs[0]];
    const titles = run => run.traces.map(trace => trace.title).join();
    unpack(data.runs, readNumbers(data.numbers));
    if (titles(old) !== titles(fresh)) { location.reload(); return; }
    fresh.traces.forEach((trace, i) => Object.assign(old.traces[i], trace));
    Object.assign(old, { name: fresh.name, count: fresh.count, period: fresh.period, poses: fresh.poses });
    by("title").textContent = `${fresh.name} on ${view.machine.name}`;
    const risen = greatestTension();
    if (risen !== most) { most = risen; addLegend(); }
    sized();
    if (live.following) {
      state.time = longest();
      show(Math.max(0, longest() - 20), Math.max(2, longest()));
    } else changed();
  }
  addKnobs();
}

async function send(name, value) {
  await fetch("/knob", { method: "POST", body: JSON.stringify({ name, value }) });
}

function knob(each) {
  const label = document.createElement("label");
  const input = document.createElement("input");
  const output = document.createElement("output");
  label.append(each.words, input);
  if (each.kind === "switch") {
    input.type = "checkbox";
    input.checked = each.value;
    input.addEventListener("change", () => send(each.name, input.checked));
  } else {
    Object.assign(input, { type: "range", min: each.low, max: each.high, step: each.step, value: each.value });
    const tell = () => { output.textContent = each.unit === "" ? input.value : `${input.value} ${each.unit}`; };
    input.addEventListener("input", tell);
    input.addEventListener("change", () => send(each.name, Number(input.value)));
    tell();
    label.append(output);
  }
  return label;
}

/** Adds the controls once: they keep what the reader has set. */
function addKnobs() {
  if (live.knobs || !live.state) return;
  live.knobs = document.createElement("div");
  live.knobs.id = "knobs";
  live.knobs.setAttribute("role", "group");
  live.knobs.setAttribute("aria-label", "the run");
  live.follow = document.createElement("button");
  live.follow.addEventListener("click", () => { live.following = !live.following; showState(); });
  live.knobs.append(live.follow);
  if (live.state.can_pause) {
    live.pause = document.createElement("button");
    live.pause.id = "hold";
    live.pause.addEventListener("click", () => send("pause", !live.state.paused));
    live.knobs.append(live.pause);
  }
  live.words = document.createElement("span");
  live.words.id = "state";
  live.words.setAttribute("role", "status");
  live.knobs.append(live.words, ...live.state.knobs.map(knob));
  document.querySelector("header").after(live.knobs);
  showState();
}

function showState() {
  if (!live.knobs) return;
  live.follow.textContent = live.following ? "Stop following" : "Follow the run";
  if (live.pause) live.pause.textContent = live.state.paused ? "Go on" : "Pause the run";
  const words = live.gone ? "the program has ended" : live.state.ended ? "the run has ended" :
    live.state.paused ? "the run is paused" : "the run goes on";
  live.words.textContent = words;
}

// Who looks back in time does not want to be taken to the end.
timeline.addEventListener("input", () => { live.following = false; showState(); });
by("play").addEventListener("click", () => { live.following = false; showState(); });
ask();
