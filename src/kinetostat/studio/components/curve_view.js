// Curves over one number, on logarithmic axes where that shows more; the present value and others are marked.
import { colour } from "kinetostat-scene/theme.js";
import { frame, logTicks, niceTicks, plot, prepare, short } from "kinetostat-studio/plot_axes.js";

const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [4, 2], [1, 2]];

export default {
  mixins: [plot],
  emits: ["pick"],
  template: `<div class="plot"><canvas role="img" :aria-label="label" @pointermove="hover" @pointerleave="leave" @click="pick"></canvas>
      <div class="plot-tip" aria-hidden="true"></div></div>`,
  methods: {
    show(curves) {
      this.curves = curves;
      this.draw();
      this.tell();
    },
    draw() {
      if (!this.curves) return;
      const sheet = prepare(this.canvas, this.$el);
      if (!sheet) return;
      const { pen, width, height } = sheet;
      const { x, lines, label, here, log, signed, tall, marks } = this.curves;
      const drawable = (value) => value !== null && (signed || value > 0);
      const right = lines.some((line) => line.name) ? 62 : 14;
      const top = marks ? 18 : 8;
      const box = { left: 0, bottom: height, x: 66, y: top, width: width - 66 - right, height: height - top - 40 };
      const known = lines.flatMap((line) => line.values).filter(drawable);
      if (box.width < 20 || box.height < 20) return;
      if (!known.length) {
        pen.fillStyle = colour("ink");
        pen.fillText("no finite value in this range", box.x, box.y + 20);
        return;
      }
      let [low, high] = [Math.min(...known), Math.max(...known)];
      const steep = low > 0 && (tall || high / low > 20);
      if (!steep) [low, high] = [low - 0.06 * (high - low || high), high + 0.06 * (high - low || high)];
      const share = (value, a, b, asLog) => (asLog ? Math.log(value / a) / Math.log(b / a) : (value - a) / (b - a));
      this.toX = (value) => box.x + box.width * share(value, x[0], x[x.length - 1], log);
      this.toY = (value) => box.y + box.height * (1 - share(value, low, high, steep));
      this.box = box;
      const across = log ? logTicks(x[0], x[x.length - 1], box.width / 55) : niceTicks(x[0], x[x.length - 1], box.width / 62);
      const up = steep ? logTicks(low, high, box.height / 30) : niceTicks(low, high, box.height / 42);
      pen.fillStyle = colour("line");
      for (const tick of up) pen.fillRect(box.x, Math.round(this.toY(tick)), box.width, 1);
      frame(pen, box, {
        x: across.map((t) => [this.toX(t), short(t)]),
        y: up.map((t) => [this.toY(t), short(t)]),
      }, label);
      if (marks) this.mark(pen, box, marks);
      if (here && here >= x[0] && here <= x[x.length - 1]) {
        pen.fillStyle = colour("accent");
        pen.fillRect(Math.round(this.toX(here)), box.y, 1.5, box.height);
      }
      pen.save();
      pen.beginPath();
      pen.rect(box.x, box.y, box.width, box.height);
      pen.clip();
      lines.forEach((line, n) => {
        pen.strokeStyle = colour(`series-${n + 1}`);
        pen.setLineDash(DASHES[n % DASHES.length]);
        pen.lineWidth = 2;
        pen.beginPath();
        let drawing = false;
        line.values.forEach((value, i) => {
          if (!drawable(value)) return (drawing = false);
          pen[drawing ? "lineTo" : "moveTo"](this.toX(x[i]), this.toY(value));
          drawing = true;
        });
        pen.stroke();
      });
      pen.restore();
      this.legend(pen, box, lines.filter((line) => line.name));
    },
    // A grey line at each mark with its number above, where there is room for it.
    mark(pen, box, marks) {
      const { x } = this.curves;
      let free = -Infinity;
      marks.forEach((value, k) => {
        if (value < x[0] || value > x[x.length - 1]) return;
        const at = this.toX(value);
        pen.fillStyle = colour("line-strong");
        pen.fillRect(Math.round(at), box.y, 1, box.height);
        const text = String(k + 1);
        const half = pen.measureText(text).width / 2;
        if (at - half < free) return;
        pen.fillStyle = colour("ink-soft");
        pen.textAlign = "center";
        pen.textBaseline = "bottom";
        pen.fillText(text, at, box.y - 3);
        free = at + half + 3;
      });
    },
    pick(event) {
      const { marks } = this.curves ?? {};
      if (!marks?.length || !this.toX) return;
      const at = event.clientX - this.canvas.getBoundingClientRect().left;
      const away = marks.map((value) => Math.abs(this.toX(value) - at));
      this.$emit("pick", away.indexOf(Math.min(...away)));
    },
    legend(pen, box, lines) {
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      lines.forEach((line, n) => {
        const y = box.y + 8 + 17 * n;
        pen.strokeStyle = colour(`series-${n + 1}`);
        pen.setLineDash(DASHES[n % DASHES.length]);
        pen.lineWidth = 2;
        pen.beginPath();
        pen.moveTo(box.x + box.width + 8, y);
        pen.lineTo(box.x + box.width + 28, y);
        pen.stroke();
        pen.setLineDash([]);
        pen.fillStyle = colour("ink");
        pen.fillText(line.name, box.x + box.width + 33, y);
      });
    },
    hover(event) {
      if (!this.curves || !this.toX) return;
      const frame = this.canvas.getBoundingClientRect();
      const at = event.clientX - frame.left;
      const { x, lines, unit } = this.curves;
      const i = x.reduce((best, value, k) => (Math.abs(this.toX(value) - at) < Math.abs(this.toX(x[best]) - at) ? k : best), 0);
      const rows = lines.map((line) => `${line.name} ${line.values[i] === null ? "–" : short(line.values[i])} ${unit}`.trim());
      this.tip.textContent = [`${short(x[i])} ${this.curves.across ?? ""}`.trim(), ...rows].join("\n");
      this.tip.style.left = `${Math.min(at + 12, frame.width - 140)}px`;
      this.tip.style.top = "18px";
      this.tip.style.display = "block";
    },
    leave() {
      this.tip.style.display = "none";
    },
  },
};
