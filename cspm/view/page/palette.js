"use strict";
// Colours that colour-blind readers can tell apart, for light and dark screens.

const dark = matchMedia("(prefers-color-scheme: dark)");
const LINES = {
  light: ["#0060a8", "#c04a00", "#00785a", "#a8458a", "#7a6200", "#2a8fd0", "#6a3fc0", "#555c66"],
  dark: ["#62b0f0", "#ff9248", "#3ccba0", "#e894cc", "#d8bc4a", "#a6d8ff", "#b79bff", "#aab4c0"],
};
// From least to most tension, lighter or darker all along, so that grey prints keep the order.
const RAMPS = {
  light: [[150, 160, 220], [96, 88, 190], [140, 30, 140], [130, 10, 60], [60, 0, 10]],
  dark: [[84, 92, 160], [120, 110, 215], [205, 110, 190], [250, 150, 110], [255, 225, 120]],
};
const RUNS = { light: ["#0060a8", "#c04a00"], dark: ["#62b0f0", "#ff9248"] };

const theme = () => (dark.matches ? "dark" : "light");
const colourOfLine = i => LINES[theme()][i % LINES.light.length];
const colourOfRun = i => RUNS[theme()][i];
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Colour of a share 0 to 1 of the greatest tension. */
function rampColour(share) {
  const ramp = RAMPS[theme()];
  const place = Math.min(1, Math.max(0, share)) * (ramp.length - 1);
  const i = Math.min(ramp.length - 2, Math.floor(place));
  const mixed = ramp[i].map((c, k) => Math.round(c + (place - i) * (ramp[i + 1][k] - c)));
  return `rgb(${mixed})`;
}

const rampCss = () => `linear-gradient(90deg, ${[0, .25, .5, .75, 1].map(rampColour)})`;

/** A canvas's context, with as many pixels as the screen has there; sizes are in CSS pixels. */
function prepared(canvas) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { pen, width, height };
}
