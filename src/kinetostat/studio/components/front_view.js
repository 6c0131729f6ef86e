// Designs as points over two objectives: the knee and the machine as it was are marked; a click or Enter picks one.
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
      const known = [...points, ...(initial ? [initial] : [])].map((point) => point[k]);
      const [low, high] = [Math.min(...known), Math.max(...known)];
      const margin = 0.07 * (high - low) || 0.05 * Math.abs(high) || 1;
      return [low - margin, high + margin];
    },
    draw() {
      if (!this.front) return;
      const sheet = prepare(this.canvas, this.$el);
      if (!sheet) return;
      const { pen, width, height } = sheet;
      const { points, knee, initial, chosen, label } = this.front;
      const box = { left: 0, bottom: height, x: 66, y: 10, width: width - 66 - 14, height: height - 10 - 40 };
      if (box.width < 20 || box.height < 20) return;
      if (!points.length) {
        pen.fillStyle = colour("ink-soft");
        pen.fillText("no feasible design yet", box.x, box.y + 20);
        return;
      }
      const [x, y] = [this.range(0), this.range(1)];
      this.toX = (value) => box.x + (box.width * (value - x[0])) / (x[1] - x[0]);
      this.toY = (value) => box.y + box.height * (1 - (value - y[0]) / (y[1] - y[0]));
      const up = niceTicks(y[0], y[1], Math.max(2, box.height / 42));
      pen.fillStyle = colour("line");
      for (const tick of up) pen.fillRect(box.x, Math.round(this.toY(tick)), box.width, 1);
      frame(pen, box, {
        x: niceTicks(x[0], x[1], Math.max(2, box.width / 70)).map((t) => [this.toX(t), short(t)]),
        y: up.map((t) => [this.toY(t), short(t)]),
      }, label);
      points.forEach((point, n) => this.dot(pen, point, n === this.near ? 6 : 4, colour("series-1")));
      this.named(pen, box, points[knee], "knee", colour("series-2"));
      if (initial) this.named(pen, box, initial, "initial", colour("ink-soft"));
      if (chosen !== null && points[chosen]) this.ring(pen, points[chosen]);
    },
    dot(pen, [x, y], size, fill) {
      pen.beginPath();
      pen.arc(this.toX(x), this.toY(y), size, 0, 7);
      pen.fillStyle = fill;
      pen.fill();
      pen.lineWidth = 1;
      pen.strokeStyle = colour("surface");
      pen.stroke();
    },
    named(pen, box, point, name, fill) {
      this.dot(pen, point, 6, fill);
      const right = this.toX(point[0]) > box.x + box.width - 60;
      pen.fillStyle = colour("ink");
      pen.textAlign = right ? "right" : "left";
      pen.textBaseline = "bottom";
      pen.fillText(name, this.toX(point[0]) + (right ? -9 : 9), this.toY(point[1]) - 3);
    },
    ring(pen, [x, y]) {
      pen.beginPath();
      pen.arc(this.toX(x), this.toY(y), 9, 0, 7);
      pen.lineWidth = 2;
      pen.strokeStyle = colour("accent");
      pen.stroke();
    },
    nearest(event) {
      if (!this.front?.points.length || !this.toX) return null;
      const area = this.canvas.getBoundingClientRect();
      const [x, y] = [event.clientX - area.left, event.clientY - area.top];
      const away = this.front.points.map((point) => Math.hypot(this.toX(point[0]) - x, this.toY(point[1]) - y));
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
      const [x, y] = [this.toX(point[0]), this.toY(point[1])];
      this.tip.textContent = `${short(point[0])}, ${short(point[1])}`;
      this.tip.style.left = `${Math.min(x + 12, this.$el.clientWidth - 130)}px`;
      this.tip.style.top = `${Math.max(y - 30, 0)}px`;
      this.tip.style.display = "block";
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
