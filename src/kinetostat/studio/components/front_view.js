// Designs as points over two objectives, a third one by colour; knee and the machine as it was are marked. A click or
// Enter picks one.
import { bandColour, bandOf, colourBar, colourScale, css } from "kinetostat-studio/colour_scale.js";
import { colour } from "kinetostat-scene/theme.js";
import { axis, frame, message, plot, short } from "kinetostat-studio/plot.js";

const NEAR = 18; // pixels within which a click means a point
const AIR = 0.07; // share of the range around the points

export default {
  mixins: [plot],
  template: `<div class="plot" tabindex="0" role="img" :aria-label="label" @pointerdown="press"
      @pointermove="hover" @pointerleave="leave" @keydown="step" @blur="leave"></div>`,
  emits: ["pick"],
  methods: {
    range(k) {
      const { points, initial, axes } = this.shown;
      const known = [...points, ...(initial ? [initial] : [])].map((point) => point[axes[k]]);
      const [low, high] = [Math.min(...known), Math.max(...known)];
      const air = AIR * (high - low) || 0.05 * Math.abs(high) || 1;
      return [low - air, high + air];
    },
    option(width, height) {
      const { points, knee, initial, chosen, axes, coloured, labels } = this.shown;
      this.$el.dataset.points = points.length;
      this.near = null;
      if (!points.length) return message("no feasible design yet");
      const [top, right] = coloured === null ? [10, 14] : [24, 78];
      const box = { left: 66, top, width: width - 66 - right, height: height - top - 40 };
      const scale = coloured === null ? null : colourScale(points.map((point) => point[coloured]));
      const bar = scale && colourBar(box, scale);
      const fill = (point) => (scale ? css(bandColour(bandOf(scale.share(point[coloured])))) : colour("series-1"));
      const place = (point) => [point[axes[0]], point[axes[1]]];
      const edge = { borderWidth: 1, borderColor: colour(scale ? "ink-soft" : "surface") };
      const line = { show: true, lineStyle: { color: colour("line") } };
      const x = this.range(0);
      const named = (point, name, color) => ({
        value: place(point), symbolSize: 12, itemStyle: { ...edge, color },
        label: {
          show: true, formatter: name, color: colour("ink"), distance: 3,
          position: (place(point)[0] - x[0]) / (x[1] - x[0]) > 1 - 60 / box.width ? "left" : "right", offset: [0, -9],
        },
      });
      const marked = [named(points[knee], "knee", scale ? fill(points[knee]) : colour("series-2"))];
      if (initial) marked.push(named(initial, "initial", colour("ink-soft")));
      const ring = { color: "transparent", borderColor: colour("accent"), borderWidth: 2 };
      return {
        grid: [frame(box), ...(bar ? [bar.grid] : [])],
        xAxis: [axis(x, box.width / 70, { name: labels[axes[0]], nameGap: 24 }), ...(bar ? [bar.xAxis] : [])],
        yAxis: [
          axis(this.range(1), box.height / 42, { name: labels[axes[1]], nameGap: 50, splitLine: line }),
          ...(bar ? [bar.yAxis] : []),
        ],
        graphic: bar ? [bar.title(`colour: ${labels[coloured]}`)] : [],
        series: [
          {
            type: "scatter", symbolSize: 8, cursor: "inherit", emphasis: { scale: 1.5 },
            data: points.map((point) => ({ value: place(point), itemStyle: { ...edge, color: fill(point) } })),
          },
          { type: "scatter", silent: true, data: marked },
          { type: "scatter", silent: true, symbolSize: 18, itemStyle: ring, data: points[chosen] ? [place(points[chosen])] : [] },
          ...(bar ? bar.series : []),
        ],
      };
    },
    place(n) {
      const { points, axes } = this.shown;
      return this.chart.convertToPixel({ gridIndex: 0 }, [points[n][axes[0]], points[n][axes[1]]]);
    },
    nearest(event) {
      if (!this.shown?.points.length || !this.chart) return null;
      const [x, y] = this.at(event);
      const away = this.shown.points.map((_, n) => Math.hypot(this.place(n)[0] - x, this.place(n)[1] - y));
      const best = away.indexOf(Math.min(...away));
      return away[best] < NEAR ? best : null;
    },
    aim(near) {
      if (near === this.near || !this.chart) return;
      this.chart.dispatchAction({ type: "downplay", seriesIndex: 0 });
      this.near = near;
      if (near === null) return this.chart.dispatchAction({ type: "hideTip" });
      const { points, labels } = this.shown;
      this.chart.dispatchAction({ type: "highlight", seriesIndex: 0, dataIndex: near });
      this.tell(points[near].map((value, k) => `${labels[k]}  ${short(value)}`).join("\n"), this.place(near));
    },
    hover(event) {
      this.aim(this.nearest(event));
    },
    leave() {
      this.aim(null);
    },
    pick(n) {
      this.shown.chosen = n;
      this.draw();
      this.$emit("pick", n);
    },
    press(event) {
      const near = this.nearest(event);
      if (event.button === 0 && near !== null) this.pick(near);
    },
    step(event) {
      if (!this.shown?.points.length) return;
      const count = this.shown.points.length;
      const at = this.near ?? this.shown.chosen ?? this.shown.knee;
      const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
      if (move) this.aim(Math.min(Math.max(at + move, 0), count - 1));
      else if (event.key === "Enter") this.pick(at);
      else return;
      event.preventDefault();
    },
  },
};
