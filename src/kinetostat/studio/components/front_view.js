// Designs as points over two objectives, a third one by colour; knee and the machine as it was are marked. A click or
// Enter picks one.
import { bandColour, bandOf, colourBar, colourScale, css } from "kinetostat-studio/colour_scale.js";
import { colour } from "kinetostat-scene/theme.js";
import { frame, niceTicks, plot, prepare, short } from "kinetostat-studio/plot_axes.js";

const NEAR = 18; // pixels within which a click means a point

export default {
  mixins: [plot],
  template: `<div class="plot"><canvas tabindex="0" role="img" :aria-label="label" @pointerdown="press"
      @pointermove="hover" @pointerleave="leave" @keydown="step" @blur="leave"></canvas>
      <div class="plot-tip" aria-hidden="true"></div></div>`,
  emits: ["pick"],
  methods: {
    show(front) {
      this.front = front;
      this.near = null;
      this.draw();
      this.tell();
      this.$el.dataset.points = front.points.length;
    },
    range(k) {
      const { points, initial } = this.front;
      const known = [...points, ...(initial ? [initial] : [])].map((point) => point[this.front.axes[k]]);
      const [low, high] = [Math.min(...known), Math.max(...known)];
      const margin = 0.07 * (high - low) || 0.05 * Math.abs(high) || 1;
      return [low - margin, high + margin];
    },
    draw() {
      if (!this.front) return;
      const sheet = prepare(this.canvas, this.$el);
      if (!sheet) return;
      const { pen, width, height } = sheet;
      const { points, knee, initial, chosen, axes, coloured, labels } = this.front;
      const [top, right] = coloured === null ? [10, 14] : [24, 78];
      const box = { left: 0, bottom: height, x: 66, y: top, width: width - 66 - right, height: height - top - 40 };
      if (box.width < 20 || box.height < 20) return;
      if (!points.length) {
        pen.fillStyle = colour("ink-soft");
        pen.fillText("no feasible design yet", box.x, box.y + 20);
        return;
      }
      const [x, y] = [this.range(0), this.range(1)];
      const toX = (value) => box.x + (box.width * (value - x[0])) / (x[1] - x[0]);
      const toY = (value) => box.y + box.height * (1 - (value - y[0]) / (y[1] - y[0]));
      this.place = (point) => [toX(point[axes[0]]), toY(point[axes[1]])];
      const up = niceTicks(y[0], y[1], Math.max(2, box.height / 42));
      pen.fillStyle = colour("line");
      for (const tick of up) pen.fillRect(box.x, Math.round(toY(tick)), box.width, 1);
      frame(pen, box, {
        x: niceTicks(x[0], x[1], Math.max(2, box.width / 70)).map((t) => [toX(t), short(t)]),
        y: up.map((t) => [toY(t), short(t)]),
      }, { x: labels[axes[0]], y: labels[axes[1]] });
      const fill = this.fills(pen, box);
      points.forEach((point, n) => this.dot(pen, point, n === this.near ? 6 : 4, fill(point)));
      this.named(pen, box, points[knee], "knee", coloured === null ? colour("series-2") : fill(points[knee]));
      if (initial) this.named(pen, box, initial, "initial", colour("ink-soft"));
      if (chosen !== null && points[chosen]) this.ring(pen, points[chosen]);
    },
    fills(pen, box) {
      const { points, coloured, labels } = this.front;
      if (coloured === null) return () => colour("series-1");
      const scale = colourScale(points.map((point) => point[coloured]));
      colourBar(pen, box, scale);
      pen.fillStyle = colour("ink");
      pen.textAlign = "right";
      pen.textBaseline = "top";
      pen.fillText(`colour: ${labels[coloured]}`, this.$el.clientWidth - 4, 4);
      return (point) => css(bandColour(bandOf(scale.share(point[coloured]))));
    },
    dot(pen, point, size, fill) {
      pen.beginPath();
      pen.arc(...this.place(point), size, 0, 7);
      pen.fillStyle = fill;
      pen.fill();
      pen.lineWidth = 1;
      pen.strokeStyle = colour(this.front.coloured === null ? "surface" : "ink-soft");
      pen.stroke();
    },
    named(pen, box, point, name, fill) {
      this.dot(pen, point, 6, fill);
      const [x, y] = this.place(point);
      const right = x > box.x + box.width - 60;
      pen.fillStyle = colour("ink");
      pen.textAlign = right ? "right" : "left";
      pen.textBaseline = "bottom";
      pen.fillText(name, x + (right ? -9 : 9), y - 3);
    },
    ring(pen, point) {
      pen.beginPath();
      pen.arc(...this.place(point), 9, 0, 7);
      pen.lineWidth = 2;
      pen.strokeStyle = colour("accent");
      pen.stroke();
    },
    nearest(event) {
      if (!this.front?.points.length || !this.place) return null;
      const area = this.canvas.getBoundingClientRect();
      const [x, y] = [event.clientX - area.left, event.clientY - area.top];
      const away = this.front.points.map((point) => {
        const [px, py] = this.place(point);
        return Math.hypot(px - x, py - y);
      });
      const best = away.indexOf(Math.min(...away));
      return away[best] < NEAR ? best : null;
    },
    aim(near) {
      if (near === this.near) return;
      this.near = near;
      this.draw();
      if (near === null) {
        this.tip.style.display = "none";
        return;
      }
      const point = this.front.points[near];
      const [x, y] = this.place(point);
      this.tip.textContent = point.map((value, k) => `${this.front.labels[k]}  ${short(value)}`).join("\n");
      this.tip.style.display = "block";
      this.tip.style.left = `${Math.max(Math.min(x + 12, this.$el.clientWidth - this.tip.offsetWidth - 4), 0)}px`;
      this.tip.style.top = `${Math.max(y - this.tip.offsetHeight - 8, 0)}px`;
    },
    hover(event) {
      this.aim(this.nearest(event));
    },
    leave() {
      if (this.front) this.aim(null);
    },
    pick(n) {
      this.front.chosen = n;
      this.draw();
      this.$emit("pick", n);
    },
    press(event) {
      const near = this.nearest(event);
      if (event.button === 0 && near !== null) this.pick(near);
    },
    step(event) {
      if (!this.front?.points.length) return;
      const count = this.front.points.length;
      const at = this.near ?? this.front.chosen ?? this.front.knee;
      const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
      if (move) this.aim(Math.min(Math.max(at + move, 0), count - 1));
      else if (event.key === "Enter") this.pick(at);
      else return;
      event.preventDefault();
    },
  },
};
