// Colours for numbers, in bands that the eye can tell apart, and the bar that says which is which.
import { colour } from "kinetostat-scene/theme.js";
import { logTicks, niceTicks, short } from "kinetostat-studio/plot_axes.js";

const VIRIDIS = [
  [68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140],
  [34, 168, 132], [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37],
];
const WIDE_RANGE = 50; // ratio of the extremes from which colours follow the logarithm
const ALIKE = 1e-9; // share of a value within which others are the same

export const BANDS = 16;

function viridis(share) {
  const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(at), VIRIDIS.length - 2);
  return VIRIDIS[i].map((c, k) => c + (VIRIDIS[i + 1][k] - c) * (at - i));
}

export function bandOf(share) {
  return Math.min(Math.max(Math.floor(share * BANDS), 0), BANDS - 1);
}

export function bandColour(band) {
  return viridis((band + 0.5) / BANDS);
}

export function css(rgb) {
  return `rgb(${rgb.map(Math.round).join(",")})`;
}

// `ends`, where given, are those between which colours resolve values; beyond them an arrow at the bar says so.
export function colourScale(known, ends) {
  const [least, greatest] = [Math.min(...known), Math.max(...known)];
  const [low, high] = ends ?? [least, greatest];
  const [log, constant] = [low > 0 && high / low > WIDE_RANGE, !(high - low > ALIKE * Math.abs(high))];
  const share = (value) => (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
  return {
    none: known.length === 0,
    share: (value) => (constant ? 0.5 : share(value)),
    ticks: constant ? [[0.5, high]] : (log ? logTicks : niceTicks)(low, high, 5).map((value) => [share(value), value]),
    below: least < low - ALIKE * (high - low),
    above: greatest > high + ALIKE * (high - low),
  };
}

export function colourBar(pen, box, scale) {
  const x = box.x + box.width + 12;
  for (let band = 0; band < BANDS; band++) {
    pen.fillStyle = css(bandColour(band));
    pen.fillRect(x, box.y + box.height * (1 - (band + 1) / BANDS), 11, box.height / BANDS + 0.6);
  }
  for (const [beyond, foot, way, band] of [
    [scale.above, box.y, -1, BANDS - 1],
    [scale.below, box.y + box.height, 1, 0],
  ]) {
    if (!beyond) continue;
    pen.fillStyle = css(bandColour(band));
    pen.beginPath();
    pen.moveTo(x, foot);
    pen.lineTo(x + 11, foot);
    pen.lineTo(x + 5.5, foot + 7 * way);
    pen.fill();
  }
  pen.fillStyle = colour("ink-soft");
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (const [share, value] of scale.ticks) {
    const at = Math.min(Math.max(box.y + box.height * (1 - share), box.y + 5), box.y + box.height - 5);
    pen.fillText(short(value), x + 15, at);
  }
}
