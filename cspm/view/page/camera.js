"use strict";
// Poses and perspective: world_ned [m] with z down to pixels of the canvas.

/** R = Rz(ψ) Ry(θ) Rx(φ) and the origin, applied to a point of the body. */
function placed(pose, point) {
  if (!pose) return point;
  const [x, y, z, roll, pitch, yaw] = pose;
  const [sr, cr, sp, cp] = [Math.sin(roll), Math.cos(roll), Math.sin(pitch), Math.cos(pitch)];
  const [sy, cy] = [Math.sin(yaw), Math.cos(yaw)];
  const [a, b, c] = point;
  return [
    x + cy * cp * a + (cy * sp * sr - sy * cr) * b + (cy * sp * cr + sy * sr) * c,
    y + sy * cp * a + (sy * sp * sr + cy * cr) * b + (sy * sp * cr - cy * sr) * c,
    z - sp * a + cp * sr * b + cp * cr * c,
  ];
}

const camera = { azimuth: -1.05, elevation: 0.3, distance: 5, centre: [0, 0, 0], size: 1 };
const VIEWS = { side: [-Math.PI / 2, 0.02], front: [0, 0.02], top: [-Math.PI / 2, 1.55] };
const LENS = 1.7; // focal length per height of the picture: about 33° from top to bottom

/** Looks at all of the given points. */
function fitCamera(points) {
  const middle = [0, 1, 2].map(i => {
    const all = points.map(p => p[i]);
    return 0.5 * (Math.min(...all) + Math.max(...all));
  });
  const far = Math.max(...points.map(p => Math.hypot(...p.map((x, i) => x - middle[i]))), 0.05);
  Object.assign(camera, { centre: middle, size: far, distance: far * 3.9 });
}

/** A function from world points to [px, px, depth, pixels per metre]; depth ≤ 0 is behind. */
function projection(width, height) {
  const { azimuth, elevation, distance, centre } = camera;
  const [sa, ca] = [Math.sin(azimuth), Math.cos(azimuth)];
  const [se, ce] = [Math.sin(elevation), Math.cos(elevation)];
  const focal = LENS * Math.min(height, width * 1.1);
  return point => {
    // z up, by half a turn about x.
    const x = point[0] - centre[0], y = centre[1] - point[1], z = centre[2] - point[2];
    const depth = distance - (x * ce * ca + y * ce * sa + z * se);
    const scale = focal / Math.max(depth, 1e-3 * distance);
    const right = -sa * x + ca * y;
    const up = -se * ca * x - se * sa * y + ce * z;
    return [width / 2 + scale * right, height / 2 - scale * up, depth, scale];
  };
}

function turn(byAzimuth, byElevation) {
  camera.azimuth += byAzimuth;
  camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + byElevation));
}

function zoom(factor) {
  camera.distance = Math.min(60 * camera.size, Math.max(1.2 * camera.size, camera.distance * factor));
}

/** Turns and zooms with pointers: one turns, two zoom. */
function attachCamera(canvas, changed) {
  const fingers = new Map();
  let spread = 0;
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    spread = 0;
  });
  canvas.addEventListener("pointermove", event => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 1) {
      turn(-0.008 * (event.clientX - last[0]), 0.008 * (event.clientY - last[1]));
    } else {
      const [one, other] = [...fingers.values()];
      const now = Math.hypot(one[0] - other[0], one[1] - other[1]);
      if (spread) zoom(spread / Math.max(now, 1));
      spread = now;
    }
    changed();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, event => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    zoom(Math.exp(0.0012 * event.deltaY));
    changed();
  }, { passive: false });
}
