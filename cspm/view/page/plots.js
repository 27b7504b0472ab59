"use strict";
// Signals over time with a cursor: drag to scrub, names to switch lines off.

const MARGIN = { left: 52, right: 8, top: 8, bottom: 20 };
const range = { from: 0, to: 1 };
const FEW = 3;

/** All titles of the runs' traces, each with the runs that have it. */
function groups() {
  const found = new Map();
  view.runs.forEach((run, index) => run.traces.forEach(trace => {
    if (!found.has(trace.title)) found.set(trace.title, { ...trace, parts: [] });
    found.get(trace.title).parts.push({ run, index, trace });
  }));
  return [...found.values()];
}

class Plot {
  constructor(group, parent, scrub) {
    this.group = group;
    const marked = group.names.filter(name => view.marks.some(mark => mark.element === name));
    this.guilty = new Set(marked);
    this.hidden = new Set();
    // Bands of many lines merge; those of few show the spread.
    this.banded = group.names.length <= FEW;
    this.still = document.createElement("canvas");
    const place = document.createElement("div");
    place.className = "plot";
    const head = document.createElement("h2");
    head.textContent = `${group.title} [${group.unit}]`;
    this.chips = document.createElement("div");
    this.chips.className = "chips";
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${group.title} over time: ${group.names.map(inWords).join(", ")}`);
    place.append(head, this.canvas, this.chips);
    parent.append(place);
    this.addChips();
    this.attach(scrub);
  }

  addChips() {
    this.readings = this.group.names.map((name, i) => {
      const chip = document.createElement("button");
      chip.setAttribute("aria-pressed", "true");
      if (this.guilty.has(name)) chip.className = "guilty";
      const swatch = document.createElement("span");
      swatch.className = "swatch";
      const words = document.createTextNode(inWords(name));
      const reading = document.createElement("span");
      chip.append(swatch, words, " ", reading);
      chip.addEventListener("click", () => {
        if (!this.hidden.delete(i)) this.hidden.add(i);
        chip.setAttribute("aria-pressed", String(!this.hidden.has(i)));
        this.redraw();
      });
      this.chips.append(chip);
      return { swatch, reading };
    });
    const band = document.createElement("button");
    band.className = "band";
    band.textContent = "bands";
    band.title = "from least to greatest value between two points of a line";
    band.setAttribute("aria-pressed", String(this.banded));
    band.addEventListener("click", () => {
      this.banded = !this.banded;
      band.setAttribute("aria-pressed", String(this.banded));
      this.redraw();
    });
    this.chips.append(band);
  }

  attach(scrub) {
    const move = event => {
      const width = this.canvas.clientWidth - MARGIN.left - MARGIN.right;
      const share = (event.offsetX - MARGIN.left) / width;
      scrub(range.from + Math.min(1, Math.max(0, share)) * (range.to - range.from));
    };
    this.canvas.addEventListener("pointerdown", event => {
      this.canvas.setPointerCapture(event.pointerId);
      move(event);
    });
    this.canvas.addEventListener("pointermove", event => { if (event.buttons) move(event); });
  }

  shown() {
    return this.group.names.map((_, i) => i).filter(i => !this.hidden.has(i));
  }

  /** Least and greatest of what is shown, or of what is marked in it, with a little room. */
  limits() {
    let [low, high] = [Infinity, -Infinity];
    const own = this.shown().filter(i => this.guilty.has(this.group.names[i]));
    const deciding = own.length ? own : this.shown();
    for (const { run, trace } of this.group.parts) {
      const wide = trace.names.length;
      const last = Math.min(run.count - 1, Math.ceil(range.to / run.period));
      for (let k = Math.max(0, Math.floor(range.from / run.period)); k <= last; k++) {
        for (const i of deciding) {
          if (trace.low[wide * k + i] < low) low = trace.low[wide * k + i];
          if (trace.high[wide * k + i] > high) high = trace.high[wide * k + i];
        }
      }
    }
    if (low > high) return [0, 1];
    const room = 0.05 * (high - low) || Math.abs(0.05 * high) || 1;
    return [low - room, high + room];
  }

  /** The shown lines, those that cover most first, so that none hides another; marked ones last. */
  widestFirst({ trace }) {
    const wide = trace.names.length, width = trace.names.map(() => 0);
    for (let k = 0; k < trace.low.length; k++) width[k % wide] += (trace.high[k] - trace.low[k]) || 0;
    const order = i => (this.guilty.has(trace.names[i]) ? -1 : width[i]);
    return this.shown().sort((i, j) => order(j) - order(i));
  }

  /** Draws the lines once; cursors come on top of what is kept. */
  redraw() {
    const { pen, width, height } = prepared(this.canvas);
    pen.clearRect(0, 0, width, height);
    const [low, high] = this.limits();
    const inner = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    this.x = t => MARGIN.left + inner[0] * (t - range.from) / (range.to - range.from);
    const y = v => MARGIN.top + inner[1] * (high - v) / (high - low);
    drawGrid(pen, this.x, y, [low, high], [width, height]);
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, MARGIN.top, ...inner);
    pen.clip();
    for (const part of [...this.group.parts].reverse()) {
      for (const i of this.widestFirst(part)) this.line(pen, part, i, y);
    }
    pen.restore();
    this.readings.forEach(({ swatch }, i) => { swatch.style.borderColor = colourOfLine(i); });
    this.still.width = this.canvas.width;
    this.still.height = this.canvas.height;
    this.still.getContext("2d").drawImage(this.canvas, 0, 0);
  }

  /** The middle as a line, and on demand the band between least and greatest value around it. */
  line(pen, { run, index, trace }, i, y) {
    const wide = trace.names.length, faint = this.guilty.size && !this.guilty.has(trace.names[i]);
    const x = k => this.x(k * run.period);
    pen.strokeStyle = pen.fillStyle = colourOfLine(i);
    pen.lineWidth = index || faint ? 1 : 1.5;
    pen.setLineDash(index ? [5, 4] : []);
    for (const [first, last] of this.stretches(run, trace, i)) {
      const outline = [], middle = [];
      for (let k = first; k <= last; k++) {
        const [low, high] = [trace.low[wide * k + i], trace.high[wide * k + i]];
        outline.push([x(k), y(high)]);
        middle.push([x(k), y(0.5 * (low + high))]);
      }
      for (let k = last; k >= first; k--) outline.push([x(k), y(trace.low[wide * k + i])]);
      pen.globalAlpha = (faint ? 0.25 : 1) * (index ? 0.15 : 0.4);
      if (this.banded) pen.fill(pathOf(outline));
      pen.globalAlpha = faint ? 0.35 : 1;
      pen.stroke(pathOf(middle));
    }
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  /** First and last frames of what is shown without a gap. */
  stretches(run, trace, i) {
    const wide = trace.names.length, found = [];
    const last = Math.min(run.count - 1, Math.ceil(range.to / run.period));
    let going = false;
    for (let k = Math.max(0, Math.floor(range.from / run.period)); k <= last; k++) {
      const there = !Number.isNaN(trace.low[wide * k + i]);
      if (there && going) found.at(-1)[1] = k;
      else if (there) found.push([k, k]);
      going = there;
    }
    return found;
  }

  cursor(time) {
    const { pen, width, height } = prepared(this.canvas);
    pen.clearRect(0, 0, width, height);
    if (this.still.width) pen.drawImage(this.still, 0, 0, width, height);
    if (!this.x) return;
    const x = this.x(time);
    if (x >= MARGIN.left - 1 && x <= width - MARGIN.right + 1) {
      pen.strokeStyle = css("--text");
      pen.lineWidth = 1;
      pen.beginPath(); pen.moveTo(x, MARGIN.top); pen.lineTo(x, height - MARGIN.bottom); pen.stroke();
    }
    const { run, trace } = this.group.parts[0];
    const values = valuesAt(run, trace.title, frameAt(run, time));
    this.readings.forEach(({ reading }, i) => { reading.textContent = values ? shortNumber(values[i]) : ""; });
  }
}

function pathOf(points) {
  const path = new Path2D();
  points.forEach(([x, y], n) => (n ? path.lineTo(x, y) : path.moveTo(x, y)));
  return path;
}

const shortNumber = value =>
  Number.isNaN(value) ? "–" : value.toFixed(Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : 2).replace("-", "−");

/** Steps of 1, 2 or 5 times a power of ten, about so many. */
function ticks(low, high, about) {
  const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(each => each * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function drawGrid(pen, x, y, [low, high], [width, height]) {
  pen.strokeStyle = css("--line");
  pen.fillStyle = css("--soft");
  pen.lineWidth = 0.7;
  pen.font = "11px system-ui, sans-serif";
  pen.textAlign = "right";
  const up = ticks(low, high, 4), along = ticks(range.from, range.to, Math.max(2, width / 90));
  for (const value of up.found) {
    pen.beginPath(); pen.moveTo(MARGIN.left, y(value)); pen.lineTo(width - MARGIN.right, y(value)); pen.stroke();
    pen.fillText(value.toFixed(up.digits).replace("-", "−"), MARGIN.left - 5, y(value) + 4);
  }
  pen.textAlign = "center";
  for (const time of along.found) {
    pen.beginPath(); pen.moveTo(x(time), MARGIN.top); pen.lineTo(x(time), height - MARGIN.bottom); pen.stroke();
    pen.fillText(`${time.toFixed(along.digits)} s`, Math.min(width - 16, x(time)), height - 6);
  }
  pen.textAlign = "left";
}
