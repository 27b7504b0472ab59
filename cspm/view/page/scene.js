"use strict";
// The machine: ship or frame, winches, cables by tension, bar, target, trails, the guilty part.

const machine = view.machine;
const TRAIL_S = 6;
const FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
const tensionTitle = "Cable tensions", angleTitle = "Motor angles";
let most = greatestTension();

function greatestTension() {
  let found = 0;
  for (const run of view.runs) {
    const trace = run.traces.find(each => each.title === tensionTitle);
    if (trace) for (const value of trace.high) if (value > found) found = value;
  }
  if (found) return found;
  return Math.max(...machine.cables.map(cable => (cable.limits ? cable.limits[1] : 0)), 1);
}

const isMarked = (kind, element) =>
  view.marks.some(mark => mark.kind === kind && mark.element === element);
const bodyMarked = name => isMarked("body", name) || isMarked("motion capture of", name);

/** Corners of a box in the world, counted by the signs of x, y, z. */
function corners(size, pose) {
  const found = [];
  for (const a of [-0.5, 0.5]) for (const b of [-0.5, 0.5]) for (const c of [-0.5, 0.5]) {
    found.push(placed(pose, [a * size[0], b * size[1], c * size[2]]));
  }
  return found;
}

/** Where a cable begins and ends; null for a winch without cable, or where the bar is not known. */
function cableEnds(cable, frame, bar) {
  if (!cable.exit || (machine.bar && !bar)) return null;
  return [placed(frame, cable.exit), placed(machine.bar ? bar : null, cable.attachment)];
}

/** Where a winch is; those without cable have no place, and are drawn in a row. */
const winchPlace = (cable, i, frame) => (cable.exit ? placed(frame, cable.exit) : [0.5 * i, 0, 0]);

/** Points that a picture of the whole run has to show. */
function extent() {
  const points = [];
  for (const run of view.runs) {
    for (let frame = 0; frame < run.count; frame += Math.max(1, Math.floor(run.count / 40))) {
      const [ship, bar] = [poseAt(run, "frame", frame), poseAt(run, "bar", frame)];
      if (machine.frame) points.push(...corners(machine.frame, ship));
      if (machine.bar && bar) points.push(...corners(machine.bar, bar));
      machine.cables.forEach((cable, i) => {
        points.push(winchPlace(cable, i, ship));
        const ends = cableEnds(cable, ship, bar);
        if (ends) points.push(ends[1]);
      });
    }
  }
  if (points.every(p => Math.hypot(...p.map((x, i) => x - points[0][i])) < 0.1)) {
    points.push(...corners([0.5, 0.5, 0.5], points[0] && [...points[0], 0, 0, 0]));
  }
  return points;
}

/** One run at one frame as shapes, each with its depth; drawn from far to near. */
function shapesOf(run, index, frame, project) {
  const [ship, bar] = [poseAt(run, "frame", frame), poseAt(run, "bar", frame)];
  const ghost = index > 0, ink = colourOfRun(index), shapes = [];
  if (machine.frame && (ship || !run.poses.frame)) {
    const ink = bodyMarked("winch_frame") ? css("--mark") : css("--soft");
    shapes.push(...box(corners(machine.frame, ship), project, ink, ghost ? 0 : 0.05, 1));
  }
  if (machine.bar && bar) {
    const marked = bodyMarked("bar") ? css("--mark") : ink;
    shapes.push(...box(corners(machine.bar, bar), project, marked, ghost ? 0.12 : 0.45, 1.6));
    const wanted = poseAt(run, "wanted", frame);
    if (wanted) shapes.push(...box(corners(machine.bar, wanted), project, css("--text"), 0, 0.8));
    shapes.push(trail(run, frame, project, ink));
  }
  const target = poseAt(run, "target", frame);
  if (target && machine.bar) {
    const plate = [1.3 * machine.bar[0], 1.3 * machine.bar[1], 0.1 * machine.bar[2]];
    shapes.push(...box(corners(plate, target), project, css("--soft"), 0.2, 1));
  }
  machine.cables.forEach((cable, i) => {
    shapes.push(...cableShapes(run, index, frame, cable, i, cableEnds(cable, ship, bar), project));
    if (!ghost) shapes.push(winch(run, frame, cable, i, winchPlace(cable, i, ship), project));
  });
  return shapes;
}

function box(points, project, ink, fill, width) {
  const seen = points.map(project);
  return FACES.map(face => ({
    depth: face.reduce((sum, k) => sum + seen[k][2], 0) / 4,
    draw(pen) {
      pen.beginPath();
      face.forEach((k, n) => (n ? pen.lineTo(seen[k][0], seen[k][1]) : pen.moveTo(seen[k][0], seen[k][1])));
      pen.closePath();
      if (fill) { pen.globalAlpha = fill; pen.fillStyle = ink; pen.fill(); pen.globalAlpha = 1; }
      pen.strokeStyle = ink; pen.lineWidth = width; pen.setLineDash([]); pen.stroke();
    },
  }));
}

function trail(run, frame, project, ink) {
  const first = Math.max(0, frame - Math.round(TRAIL_S / run.period));
  const points = [];
  for (let k = first; k <= frame; k++) {
    const pose = poseAt(run, "bar", k);
    if (pose) points.push(project(pose));
  }
  return {
    depth: points.length ? points.at(-1)[2] : 0,
    draw(pen) {
      pen.strokeStyle = ink; pen.lineWidth = 2; pen.setLineDash([]);
      for (let k = 1; k < points.length; k++) {
        pen.globalAlpha = 0.9 * k / points.length;
        pen.beginPath(); pen.moveTo(points[k - 1][0], points[k - 1][1]);
        pen.lineTo(points[k][0], points[k][1]); pen.stroke();
      }
      pen.globalAlpha = 1;
    },
  };
}

function cableShapes(run, index, frame, cable, i, ends, project) {
  if (!ends) return [];
  const tensions = valuesAt(run, tensionTitle, frame);
  const tension = tensions ? tensions[i] : null;
  const slack = tension !== null && tension <= machine.slack;
  const [a, b] = ends.map(project);
  const share = tension === null ? 0.4 : Math.max(0, tension) / most;
  const marked = isMarked("cable", cable.name) || isMarked("load cell", cable.name);
  return [{
    depth: 0.5 * (a[2] + b[2]),
    draw(pen) {
      const line = (ink, width, dash) => {
        pen.strokeStyle = ink; pen.lineWidth = width; pen.setLineDash(dash);
        pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke();
        pen.setLineDash([]);
      };
      if (index > 0) { line(colourOfRun(index), 1.2, []); return; }
      if (marked) { pen.globalAlpha = 0.35; line(css("--mark"), 12, []); pen.globalAlpha = 1; }
      if (slack) line(css("--text"), 2.5, [9, 8]);
      else line(tension === null ? css("--soft") : rampColour(share), 2 + 2.5 * share, []);
    },
  }];
}

/** A drum with a hand that turns with the motor. */
function winch(run, frame, cable, i, place, project) {
  const [x, y, depth, scale] = project(place);
  const alone = !cable.exit;
  const radius = Math.max(6, Math.min(alone ? 70 : 13, scale * (alone ? 0.15 : 0.04)));
  const angles = valuesAt(run, angleTitle, frame);
  const marked = isMarked("winch", cable.name);
  return {
    depth: depth - 1e-3,
    draw(pen) {
      pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.fillStyle = css("--panel"); pen.fill();
      pen.strokeStyle = marked ? css("--mark") : css("--text");
      pen.lineWidth = marked ? 4 : 1.5; pen.stroke();
      if (angles) {
        const angle = angles[i] / cable.gear_ratio;
        pen.beginPath(); pen.moveTo(x, y);
        pen.lineTo(x + radius * Math.cos(angle), y + radius * Math.sin(angle)); pen.stroke();
      }
      if (marked) { pen.beginPath(); pen.arc(x, y, radius + 7, 0, 2 * Math.PI); pen.stroke(); }
    },
  };
}

/** Names beside the winches, the marked ones first; none covers another. */
function drawNames(pen, run, frame, project) {
  const ship = poseAt(run, "frame", frame), taken = [];
  const named = machine.cables.map((cable, i) => ({
    text: inWords(cable.name),
    marked: view.marks.some(mark => mark.element === cable.name),
    place: project(winchPlace(cable, i, ship)),
  }));
  for (const { text, marked, place } of named.sort((one, other) => other.marked - one.marked)) {
    pen.font = `${marked ? "bold 15" : "12"}px system-ui, sans-serif`;
    const x = place[0] + 9, wide = pen.measureText(text).width + 6;
    let top = Math.max(16, place[1] - 14);
    const covers = each =>
      x < each.x + each.wide && each.x < x + wide && Math.abs(each.top - top) < 15;
    for (let tries = 0; tries < 12 && taken.some(covers); tries++) {
      top += top > 30 && tries < 6 ? -15 : 15;
    }
    taken.push({ x, top, wide });
    pen.fillStyle = marked ? css("--mark") : css("--soft");
    pen.fillText(text, x, top);
  }
}

function drawAxes(pen, height) {
  const { azimuth, elevation } = camera;
  const [sa, ca, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
  const axes = [["surge x", [1, 0, 0]], ["sway y", [0, -1, 0]], ["heave z", [0, 0, -1]]];
  pen.font = "11px system-ui, sans-serif";
  pen.lineWidth = 1.5;
  for (const [name, [x, y, z]] of axes) {
    const dx = 26 * (-sa * x + ca * y), dy = -26 * (-se * ca * x - se * sa * y + ce * z);
    pen.strokeStyle = pen.fillStyle = css("--soft");
    pen.beginPath(); pen.moveTo(48, height - 44); pen.lineTo(48 + dx, height - 44 + dy); pen.stroke();
    pen.fillText(name, 48 + 1.25 * dx - 12, height - 40 + 1.4 * dy);
  }
}

function drawScene(canvas, time) {
  const { pen, width, height } = prepared(canvas);
  pen.clearRect(0, 0, width, height);
  const project = projection(width, height);
  const frames = view.runs.map(run => frameAt(run, time));
  const shapes = view.runs.flatMap((run, i) => (frames[i] < 0 ? [] : shapesOf(run, i, frames[i], project)));
  shapes.sort((one, other) => other.depth - one.depth);
  for (const shape of shapes) shape.draw(pen);
  if (frames[0] >= 0) drawNames(pen, view.runs[0], frames[0], project);
  drawAxes(pen, height);
}
