// A map of one quantity over two coordinates; a click or an arrow key asks the machine to go there.
import { bandColour, bandOf, colourBar, colourScale } from "kinetostat-studio/colour_scale.js";
import { colour } from "kinetostat-scene/theme.js";
import { frame, niceTicks, plot, prepare, short } from "kinetostat-studio/plot_axes.js";

const STRIP = 0.3; // least side of a map with equal scales, as a share of the room

export default {
  mixins: [plot],
  template: `<div class="plot"><canvas tabindex="0" role="img" :aria-label="label" @pointerdown="press"
      @pointermove="hover" @pointerup="release" @pointerleave="leave" @keydown="step"></canvas>
      <div class="plot-tip" aria-hidden="true"></div></div>`,
  emits: ["pick", "settle"],
  methods: {
    show(map) {
      this.map = map;
      this.scale = colourScale(map.values.filter((value) => value !== null), map.ends);
      this.draw();
      this.tell();
    },
    mark(here) {
      if (!this.map) return;
      this.map.here = here;
      this.draw();
    },
    draw() {
      if (!this.map) return;
      const sheet = prepare(this.canvas, this.$el);
      if (!sheet) return;
      const { pen, width, height } = sheet;
      const box = { left: 0, bottom: height, x: 58, y: 18, width: width - 58 - 70, height: height - 18 - 48 };
      this.box = box;
      if (box.width < 20 || box.height < 20) return;
      this.makeEqual(box);
      this.paint(pen, box, sheet.ratio);
      const { x, y } = this.map;
      const across = niceTicks(x.low, x.high, Math.max(2, box.width / 46));
      const up = niceTicks(y.low, y.high, Math.max(2, box.height / 42));
      frame(pen, box, {
        x: across.map((t) => [this.toX(t), short(t)]),
        y: up.map((t) => [this.toY(t), short(t)]),
      }, { x: x.label, y: y.label });
      if (!this.scale.none) {
        colourBar(pen, box, this.scale);
        pen.textAlign = "right";
        pen.fillText(this.map.unit === "1" ? "" : this.map.unit, width - 2, 7);
      }
      this.cross(pen, box);
    },
    // Lengths on both axes have one scale, unless the map would become a strip.
    makeEqual(box) {
      const { x, y, alike } = this.map;
      if (!alike) return;
      const scale = Math.min(box.width / (x.high - x.low), box.height / (y.high - y.low));
      const [width, height] = [scale * (x.high - x.low), scale * (y.high - y.low)];
      if (Math.min(width, height) < STRIP * Math.min(box.width, box.height)) return;
      box.x += (box.width - width) / 2;
      box.y += (box.height - height) / 2;
      Object.assign(box, { width, height, left: box.x - 58, bottom: box.y + height + 40 });
    },
    paint(pen, box, ratio) {
      const { nx, ny, values } = this.map;
      const [w, h] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
      const image = pen.createImageData(w, h);
      const bands = new Int16Array(w * h);
      const shares = values.map((value) => (value === null ? null : this.scale.share(value)));
      const empty = colour("surface-sunk");
      const [er, eg, eb] = [1, 3, 5].map((i) => parseInt(empty.slice(i, i + 2), 16));
      for (let j = 0; j < h; j++) {
        const v = (1 - (j + 0.5) / h) * (ny - 1);
        const j0 = Math.min(Math.floor(v), ny - 2);
        for (let i = 0; i < w; i++) {
          const u = ((i + 0.5) / w) * (nx - 1);
          const i0 = Math.min(Math.floor(u), nx - 2);
          const [fu, fv] = [u - i0, v - j0];
          const k = i0 * ny + j0;
          const corners = [shares[k], shares[k + ny], shares[k + 1], shares[k + ny + 1]];
          const at = 4 * (j * w + i);
          image.data[at + 3] = 255;
          const nearest = corners[(fu > 0.5 ? 1 : 0) + (fv > 0.5 ? 2 : 0)];
          if (nearest === null) {
            bands[j * w + i] = -1;
            const stripe = (i + j) % Math.round(7 * ratio) < ratio ? 0.86 : 1;
            [image.data[at], image.data[at + 1], image.data[at + 2]] = [er * stripe, eg * stripe, eb * stripe];
            continue;
          }
          const whole = corners.map((corner) => (corner === null ? nearest : corner));
          const share = (1 - fv) * ((1 - fu) * whole[0] + fu * whole[1]) + fv * ((1 - fu) * whole[2] + fu * whole[3]);
          const band = bandOf(share);
          bands[j * w + i] = band;
          const left = i > 0 ? bands[j * w + i - 1] : band;
          const above = j > 0 ? bands[(j - 1) * w + i] : band;
          const edge = (left >= 0 && left !== band) || (above >= 0 && above !== band);
          const rgb = bandColour(band);
          for (let c = 0; c < 3; c++) image.data[at + c] = edge ? rgb[c] * 0.55 + 255 * 0.45 : rgb[c];
        }
      }
      pen.putImageData(image, Math.round(box.x * ratio), Math.round(box.y * ratio));
      if (this.scale.none) {
        pen.fillStyle = colour("ink");
        pen.textAlign = "center";
        pen.fillText("no pose has an answer here", box.x + box.width / 2, box.y + box.height / 2);
      }
    },
    cross(pen, box) {
      const { here } = this.map;
      if (!here) return;
      const [x, y] = [this.toX(here[0]), this.toY(here[1])];
      const outside = x < box.x - 1 || x > box.x + box.width + 1 || y < box.y - 1 || y > box.y + box.height + 1;
      this.$el.dataset.outside = outside;
      if (outside) return this.pointAway(pen, box, x, y);
      for (const [width, style] of [[4, "rgba(0,0,0,.55)"], [2, "#fff"]]) {
        pen.lineWidth = width;
        pen.strokeStyle = style;
        pen.beginPath();
        pen.arc(x, y, 7, 0, 7);
        for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          pen.moveTo(x + 7 * dx, y + 7 * dy);
          pen.lineTo(x + 13 * dx, y + 13 * dy);
        }
        pen.stroke();
      }
    },
    // An arrow at the border shows where the pose lies that the map does not reach.
    pointAway(pen, box, x, y) {
      const clip = (at, low, size) => Math.min(Math.max(at, low + 12), low + size - 12);
      const [nearX, nearY] = [clip(x, box.x, box.width), clip(y, box.y, box.height)];
      pen.save();
      pen.translate(nearX, nearY);
      pen.rotate(Math.atan2(y - nearY, x - nearX));
      pen.beginPath();
      for (const [dx, dy] of [[9, 0], [-6, -7], [-3, 0], [-6, 7]]) pen.lineTo(dx, dy);
      pen.closePath();
      [pen.lineWidth, pen.strokeStyle, pen.fillStyle] = [3, "rgba(0,0,0,.55)", "#fff"];
      pen.stroke();
      pen.fill();
      pen.restore();
    },
    toX(value) {
      const { low, high } = this.map.x;
      return this.box.x + (this.box.width * (value - low)) / (high - low);
    },
    toY(value) {
      const { low, high } = this.map.y;
      return this.box.y + this.box.height * (1 - (value - low) / (high - low));
    },
    where(event) {
      const frame = this.canvas.getBoundingClientRect();
      const u = (event.clientX - frame.left - this.box.x) / this.box.width;
      const v = 1 - (event.clientY - frame.top - this.box.y) / this.box.height;
      const inside = u >= 0 && u <= 1 && v >= 0 && v <= 1;
      const clip = (share) => Math.min(Math.max(share, 0), 1);
      return { u: clip(u), v: clip(v), inside };
    },
    pick({ u, v }) {
      const { x, y } = this.map;
      const here = [x.low + (x.high - x.low) * u, y.low + (y.high - y.low) * v];
      this.mark(here);
      this.$emit("pick", { x: here[0], y: here[1] });
    },
    press(event) {
      if (!this.map || event.button !== 0) return;
      const at = this.where(event);
      if (!at.inside) return;
      this.dragging = true;
      this.canvas.setPointerCapture(event.pointerId);
      this.pick(at);
    },
    hover(event) {
      if (!this.map || !this.box) return;
      const at = this.where(event);
      if (this.dragging) this.pick(at);
      if (!at.inside) return this.leave();
      const { nx, ny, values, x, y, unit } = this.map;
      const value = values[Math.round(at.u * (nx - 1)) * ny + Math.round(at.v * (ny - 1))];
      const place = `${short(x.low + (x.high - x.low) * at.u)}, ${short(y.low + (y.high - y.low) * at.v)}`;
      this.tip.textContent = value === null ? `${place}: no answer` : `${place}: ${short(value)} ${unit}`;
      const frame = this.canvas.getBoundingClientRect();
      this.tip.style.left = `${Math.min(event.clientX - frame.left + 12, frame.width - 150)}px`;
      this.tip.style.top = `${event.clientY - frame.top + 14}px`;
      this.tip.style.display = "block";
    },
    release() {
      if (this.dragging) this.$emit("settle");
      this.dragging = false;
    },
    leave() {
      this.tip.style.display = "none";
    },
    step(event) {
      const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      const move = moves[event.key];
      if (!move || !this.map?.here) return;
      event.preventDefault();
      const { x, y, here } = this.map;
      const clip = (share) => Math.min(Math.max(share, 0), 1);
      this.pick({
        u: clip((here[0] - x.low) / (x.high - x.low) + 0.02 * move[0]),
        v: clip((here[1] - y.low) / (y.high - y.low) + 0.02 * move[1]),
      });
      this.$emit("settle");
    },
  },
};
