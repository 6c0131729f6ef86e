// Colours for numbers, in bands that the eye can tell apart, and the bar that says which is which.
import { colour } from "kinetostat-scene/theme.js";
import { axis, frame } from "kinetostat-studio/plot.js";

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
    log, constant, low, high,
    below: least < low - ALIKE * (high - low),
    above: greatest > high + ALIKE * (high - low),
  };
}

// What ECharts draws as the bar right of a plot: a second grid, filled with the colours, whose axis has the values.
export function colourBar(box, scale) {
  const bar = { left: box.left + box.width + 12, top: box.top, width: 11, height: box.height };
  const stops = Array.from({ length: BANDS }, (_, band) => css(bandColour(band)));
  const colorStops = stops.flatMap((color, band) => [{ offset: band / BANDS, color }, { offset: (band + 1) / BANDS, color }]);
  const [low, high] = scale.constant ? [scale.high - 1, scale.high + 1] : [scale.low, scale.high];
  const upright = axis([low, high], 5, { type: scale.log ? "log" : "value", position: "right", gridIndex: 1, axisTick: { show: false } });
  if (scale.constant) upright.axisLabel.customValues = [scale.high];
  Object.assign(upright.axisLabel, { margin: 4, verticalAlignMinLabel: "bottom", verticalAlignMaxLabel: "top" });
  const arrow = (beyond, value, band, symbolRotate, shift) => ({
    type: "scatter", xAxisIndex: 1, yAxisIndex: 1, silent: true, symbol: "triangle", symbolSize: [11, 7], symbolRotate,
    symbolOffset: [0, shift], itemStyle: { color: css(bandColour(band)) }, clip: false, data: beyond ? [[0.5, value]] : [],
  });
  return {
    grid: { ...frame(bar), borderWidth: 0, backgroundColor: { type: "linear", x: 0, y: 1, x2: 0, y2: 0, colorStops } },
    xAxis: { show: false, type: "value", min: 0, max: 1, gridIndex: 1 },
    yAxis: upright,
    series: [arrow(scale.above, high, BANDS - 1, 0, -3.5), arrow(scale.below, low, 0, 180, 3.5)],
    title: (text) => ({ type: "text", right: 2, top: 2, style: { text, fill: colour("ink-soft"), font: '11px Roboto, "Segoe UI", sans-serif' } }),
  };
}
