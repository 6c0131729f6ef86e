// What plots share: a chart of ECharts that follows the size and the colours of the page, its axes and its numbers.
import { echarts } from "nicegui-echart";
import { colour, onTheme } from "kinetostat-scene/theme.js";

const FONT = { fontFamily: 'Roboto, "Segoe UI", sans-serif', fontSize: 11 };
const LEAST_ROOM = [110, 80]; // pixels; a view that is hidden has none

export const plot = {
  props: { label: String },
  template: `<div class="plot" role="img" :aria-label="label"></div>`,
  mounted() {
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.$el);
    this.themes = onTheme(() => this.draw());
  },
  beforeUnmount() {
    this.observer.disconnect();
    this.themes.disconnect();
    this.chart?.dispose();
  },
  methods: {
    show(data) {
      this.shown = data;
      this.draw();
      this.$el.dataset.shown = Number(this.$el.dataset.shown ?? 0) + 1;
    },
    // A component has `option`, which returns what ECharts is to draw of `shown` in a room of this width and height.
    draw() {
      const [width, height] = [this.$el.clientWidth, this.$el.clientHeight];
      if (!this.shown || width < LEAST_ROOM[0] || height < LEAST_ROOM[1]) return;
      this.chart ??= echarts.init(this.$el, null, { devicePixelRatio: Math.min(window.devicePixelRatio || 1, 2) });
      if (this.chart.getWidth() !== width || this.chart.getHeight() !== height) this.chart.resize();
      const tooltip = {
        confine: true, triggerOn: "none", transitionDuration: 0, padding: [3, 8], borderWidth: 0, shadowBlur: 0,
        backgroundColor: colour("ink"), extraCssText: "white-space: pre; border-radius: 5px; line-height: 1.4",
        textStyle: { ...FONT, fontSize: 12, color: colour("surface") },
      };
      const option = this.option(width, height);
      this.chart.setOption({ animation: false, textStyle: FONT, ...option, tooltip: { ...tooltip, ...option.tooltip } }, true);
    },
    // The place of a pointer in pixels of the plot.
    at(event) {
      const frame = this.$el.getBoundingClientRect();
      return [event.clientX - frame.left, event.clientY - frame.top];
    },
    tell(text, [x, y]) {
      this.chart.dispatchAction({ type: "showTip", x, y, tooltip: text });
    },
    leave() {
      this.chart?.dispatchAction({ type: "hideTip" });
    },
  },
};

export function message(text) {
  return { graphic: { type: "text", left: 66, top: 16, style: { ...FONT, text, fill: colour("ink-soft") } } };
}

export function frame(box) {
  return { show: true, z: 3, ...box, borderColor: colour("line-strong"), backgroundColor: "transparent" };
}

// An axis from `low` to `high` with about `wanted` ticks; its name stands `gap` pixels beside it.
export function axis([low, high], wanted, more) {
  const ticks = (more.type === "log" ? logTicks : niceTicks)(low, high, Math.max(2, wanted));
  return {
    type: "value", min: low, max: high, nameLocation: "middle", nameTextStyle: { ...FONT, color: colour("ink") },
    axisLine: { show: false, onZero: false },
    axisTick: { show: true, length: 4, customValues: ticks, lineStyle: { color: colour("line-strong") } },
    axisLabel: { ...FONT, color: colour("ink-soft"), margin: 7, customValues: ticks, formatter: short, showMinLabel: true, showMaxLabel: true },
    splitLine: { show: false, lineStyle: { color: colour("line") } },
    ...more,
  };
}

export function niceTicks(low, high, wanted) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const steps = [0.1, 0.2, 0.25, 0.5, 1, 2, 2.5, 5, 10].map((s) => s * power);
  let number = steps.findIndex((s) => s >= rough * 0.999);
  let ticks = [];
  do { // a range of few ticks may have a single multiple of the step, which would give no scale
    const step = steps[number];
    ticks = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) ticks.push(i * step);
  } while (ticks.length < 2 && number-- > 0);
  return ticks;
}

function logTicks(low, high, wanted) {
  const [a, b] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const step = Math.max(1, Math.ceil((b - a) / wanted));
  const ticks = [];
  for (let i = a; i <= b; i += step) ticks.push(10 ** i);
  return ticks.length > 1 ? ticks : niceTicks(low, high, wanted).filter((t) => t > 0);
}

const POWERS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

export function short(value) {
  if (value === 0 || Math.abs(value) < 1e-300) return "0";
  const size = Math.abs(value);
  if (size >= 1e-3 && size < 1e5) return String(Number(value.toPrecision(4)));
  const power = Math.floor(Math.log10(size) + 1e-9);
  const digits = [...String(Math.abs(power))].map((d) => POWERS[Number(d)]).join("");
  const lead = Number((value / 10 ** power).toPrecision(3));
  return `${lead === 1 ? "" : `${lead}·`}10${power < 0 ? "⁻" : ""}${digits}`;
}
