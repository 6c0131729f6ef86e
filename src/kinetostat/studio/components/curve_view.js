// Curves over one number, on logarithmic axes where that shows more; the present value and others are marked.
import { colour } from "kinetostat-scene/theme.js";
import { axis, frame, message, plot, short } from "kinetostat-studio/plot.js";

const DASHES = ["solid", [7, 3], [2, 3], [9, 3, 2, 3], [4, 2], [1, 2]];
const STEEP = 20; // ratio of the extremes from which the upright axis is logarithmic
const SAME = 1e-6; // share of a mark within which others have one line
const AIR = 0.06; // share of the range above and below curves on an axis that is not

export default {
  mixins: [plot],
  emits: ["pick"],
  template: `<div class="plot" role="img" :aria-label="label" @click="pick"></div>`,
  methods: {
    // Moves the line of the present value.
    mark(here) {
      if (!this.shown) return;
      this.shown.here = here;
      this.draw();
    },
    option(width, height) {
      const { x, lines, label, here, log, signed, tall, marks, unit, across } = this.shown;
      const drawable = (value) => value !== null && (signed || value > 0);
      const known = lines.flatMap((line) => line.values).filter(drawable);
      if (!known.length) return message("no finite value in this range");
      const named = lines.some((line) => line.name);
      const box = { left: 66, top: marks ? 18 : 8, width: width - 66 - (named ? 62 : 14) };
      box.height = height - box.top - 40;
      const range = [x[0], x[x.length - 1]];
      let [low, high] = [Math.min(...known), Math.max(...known)];
      const steep = low > 0 && (tall || high / low > STEEP);
      const air = steep ? 0 : AIR * (high - low || Math.abs(high) || 1);
      const xAxis = { type: log ? "log" : "value", gridIndex: 0 };
      return {
        grid: frame(box),
        xAxis: [
          axis(range, box.width / (log ? 55 : 62), { ...xAxis, name: label.x, nameGap: 24 }),
          ...(marks ? [this.top(range, marks, xAxis)] : []),
        ],
        yAxis: axis([low - air, high + air], box.height / (steep ? 30 : 42), {
          type: steep ? "log" : "value", name: label.y, nameGap: 50, splitLine: { show: true, lineStyle: { color: colour("line") } },
        }),
        legend: {
          show: named, orient: "vertical", left: box.left + box.width + 4, top: box.top, padding: 0, itemGap: 5, itemWidth: 20,
          itemHeight: 12, selectedMode: false, itemStyle: { opacity: 0 }, textStyle: { color: colour("ink") }, data: lines.map((line) => line.name),
        },
        tooltip: {
          trigger: "axis", triggerOn: "mousemove",
          formatter: (rows) => {
            const place = `${short(x[rows[0].dataIndex])} ${across ?? ""}`.trim();
            const value = (line) => line.values[rows[0].dataIndex];
            const told = lines.map((line) => `${line.name} ${value(line) === null ? "–" : short(value(line))} ${unit}`.trim());
            return Object.assign(document.createElement("div"), { textContent: [place, ...told].join("\n") });
          },
        },
        series: lines.map((line, n) => ({
          type: "line", name: line.name, showSymbol: false, symbol: "none", silent: true, color: colour(`series-${n + 1}`),
          lineStyle: { width: 2, type: DASHES[n % DASHES.length], color: colour(`series-${n + 1}`) },
          data: line.values.map((value, i) => [x[i], drawable(value) ? value : null]),
          ...(n === 0 && here && here >= range[0] && here <= range[1] ? { markLine: present(here) } : {}),
        })),
      };
    },
    // An axis above, whose ticks are the marks: a grey line at each with its number, where there is room for it.
    top(range, marks, more) {
      const places = marks.filter((value) => value >= range[0] && value <= range[1]);
      return axis(range, 2, {
        ...more, position: "top", axisTick: { show: false, customValues: places },
        splitLine: { show: true, lineStyle: { color: colour("line-strong") } },
        axisLabel: {
          color: colour("ink-soft"), margin: 4, customValues: places, hideOverlap: true,
          formatter: (value) => String(marks.findIndex((mark) => Math.abs(mark - value) < SAME * value) + 1),
        },
      });
    },
    pick(event) {
      const { marks } = this.shown ?? {};
      if (!marks?.length || !this.chart) return;
      const at = this.at(event)[0];
      const away = marks.map((value) => Math.abs(this.chart.convertToPixel({ xAxisIndex: 0 }, value) - at));
      this.$emit("pick", away.indexOf(Math.min(...away)));
    },
  },
};

function present(here) {
  const lineStyle = { color: colour("accent"), width: 1.5, type: "solid" };
  return { silent: true, symbol: "none", label: { show: false }, lineStyle, data: [{ xAxis: here }] };
}
