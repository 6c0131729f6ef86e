// A map of one quantity over two coordinates; a click or an arrow key asks the machine to go there.
import { BANDS, bandColour, bandOf, colourBar, colourScale } from "kinetostat-studio/colour_scale.js";
import { colour } from "kinetostat-scene/theme.js";
import { axis, frame, plot, short } from "kinetostat-studio/plot.js";

const STRIP = 0.3; // least side of a map with equal scales, as a share of the room
const CROSS = "M-7,0A7,7,0,1,1,7,0A7,7,0,1,1,-7,0M7,0H13M-7,0H-13M0,7V13M0,-7V-13";
const ARROW = "M9,0L-6,-7L-3,0L-6,7Z";
const packed = ([r, g, b]) => 0xff000000 | (b << 16) | (g << 8) | r; // a pixel of a canvas
const clip = (share) => Math.min(Math.max(share, 0), 1);

export default {
  mixins: [plot],
  template: `<div class="plot" tabindex="0" role="img" :aria-label="label" @pointerdown="press"
      @pointermove="hover" @pointerup="release" @pointerleave="leave" @keydown="step"></div>`,
  emits: ["pick", "settle"],
  methods: {
    show(map) {
      this.scale = colourScale(map.values.filter((value) => value !== null), map.ends);
      plot.methods.show.call(this, map);
    },
    mark(here) {
      if (!this.shown) return;
      this.shown.here = here;
      this.chart?.setOption({ series: [{ id: "cross", data: [here] }] });
    },
    option(width, height) {
      const { x, y, unit, here } = this.shown;
      const box = this.equal({ left: 58, top: 18, width: width - 58 - 70, height: height - 18 - 48 });
      const image = this.paint(box, Math.min(window.devicePixelRatio || 1, 2));
      const picture = { image, x: box.left, y: box.top, width: box.width, height: box.height };
      const bar = this.scale.none ? null : colourBar(box, this.scale);
      const none = {
        type: "text", left: box.left + box.width / 2 - 80, top: box.top + box.height / 2 - 6,
        style: { text: "no pose has an answer here", fill: colour("ink"), width: 160, textAlign: "center" },
      };
      return {
        grid: [frame(box), ...(bar ? [bar.grid] : [])],
        xAxis: [axis([x.low, x.high], box.width / 46, { name: x.label, nameGap: 26 }), ...(bar ? [bar.xAxis] : [])],
        yAxis: [axis([y.low, y.high], box.height / 42, { name: y.label, nameGap: 44 }), ...(bar ? [bar.yAxis] : [])],
        graphic: bar ? [bar.title(unit === "1" ? "" : unit)] : [none],
        series: [
          { type: "custom", silent: true, data: [[x.low, y.low]], renderItem: () => ({ type: "image", style: picture }) },
          ...(bar ? bar.series : []),
          { type: "custom", id: "cross", silent: true, clip: false, z: 3, data: here ? [here] : [], renderItem: (_, api) => this.cross(api, box) },
        ],
      };
    },
    // Lengths on both axes have one scale, unless the map would become a strip.
    equal(box) {
      const { x, y, alike } = this.shown;
      const scale = Math.min(box.width / (x.high - x.low), box.height / (y.high - y.low));
      const [width, height] = [scale * (x.high - x.low), scale * (y.high - y.low)];
      if (!alike || Math.min(width, height) < STRIP * Math.min(box.width, box.height)) return box;
      return { left: box.left + (box.width - width) / 2, top: box.top + (box.height - height) / 2, width, height };
    },
    // The map between its poses as well: bands of colour with light edges, and stripes where there is no answer.
    paint(box, ratio) {
      const { nx, ny, values } = this.shown;
      const [w, h] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
      const canvas = Object.assign(document.createElement("canvas"), { width: w, height: h });
      const image = new ImageData(w, h);
      const pixels = new Uint32Array(image.data.buffer);
      const bands = new Int16Array(w * h);
      const shares = Float64Array.from(values, (value) => (value === null ? NaN : this.scale.share(value)));
      const sunk = colour("surface-sunk");
      const empty = [1, 3, 5].map((i) => parseInt(sunk.slice(i, i + 2), 16));
      const [plain, stripe] = [packed(empty), packed(empty.map((c) => 0.86 * c))];
      const colours = Array.from({ length: BANDS }, (_, band) => bandColour(band));
      const [inner, edges] = [colours.map(packed), colours.map((rgb) => packed(rgb.map((c) => c * 0.55 + 255 * 0.45)))];
      const [across, period] = [between(w, nx), Math.round(7 * ratio)];
      between(h, ny).forEach(([j0, fv], row) => {
        const j = h - 1 - row;
        for (let i = 0; i < w; i++) {
          const [i0, fu] = across[i];
          const [k, at] = [i0 * ny + j0, j * w + i];
          const [a, b, c, d] = [shares[k], shares[k + ny], shares[k + 1], shares[k + ny + 1]];
          const nearest = fv > 0.5 ? (fu > 0.5 ? d : c) : fu > 0.5 ? b : a;
          if (nearest !== nearest) {
            bands[at] = -1;
            pixels[at] = (i + j) % period < ratio ? stripe : plain;
            continue;
          }
          const whole = (corner) => (corner === corner ? corner : nearest);
          const share = (1 - fv) * ((1 - fu) * whole(a) + fu * whole(b)) + fv * ((1 - fu) * whole(c) + fu * whole(d));
          bands[at] = bandOf(share);
        }
      });
      for (let at = 0; at < bands.length; at++) {
        if (bands[at] < 0) continue;
        const left = at % w ? bands[at - 1] : -1;
        const above = at >= w ? bands[at - w] : -1;
        const edge = (left >= 0 && left !== bands[at]) || (above >= 0 && above !== bands[at]);
        pixels[at] = (edge ? edges : inner)[bands[at]];
      }
      canvas.getContext("2d").putImageData(image, 0, 0);
      return canvas;
    },
    // The mark of the pose; where the map does not reach it, an arrow at the border shows where it lies.
    cross(api, box) {
      const [x, y] = api.coord([api.value(0), api.value(1)]);
      const inside = (at, low, size) => Math.min(Math.max(at, low), low + size);
      const away = Math.hypot(inside(x, box.left, box.width) - x, inside(y, box.top, box.height) - y) > 1;
      this.$el.dataset.outside = away;
      const near = [inside(x, box.left + 12, box.width - 24), inside(y, box.top + 12, box.height - 24)];
      const shape = { pathData: away ? ARROW : CROSS };
      const stroke = (lineWidth, colour, fill) => ({ type: "path", shape, style: { stroke: colour, lineWidth, fill } });
      return {
        type: "group", x: away ? near[0] : x, y: away ? near[1] : y, rotation: away ? -Math.atan2(y - near[1], x - near[0]) : 0,
        children: [stroke(away ? 3 : 4, "rgba(0,0,0,.55)", "none"), stroke(away ? 0 : 2, "#fff", away ? "#fff" : "none")],
      };
    },
    where(event) {
      const pixel = this.at(event);
      const [x, y] = this.chart.convertFromPixel({ gridIndex: 0 }, pixel);
      return { ...this.shares(x, y), pixel, inside: this.chart.containPixel({ gridIndex: 0 }, pixel) };
    },
    shares(px, py) {
      const { x, y } = this.shown;
      return { u: clip((px - x.low) / (x.high - x.low)), v: clip((py - y.low) / (y.high - y.low)) };
    },
    point({ u, v }) {
      const { x, y } = this.shown;
      return [x.low + (x.high - x.low) * u, y.low + (y.high - y.low) * v];
    },
    pick(at) {
      const here = this.point(at);
      this.mark(here);
      this.$emit("pick", { x: here[0], y: here[1] });
    },
    press(event) {
      if (!this.chart || event.button !== 0) return;
      const at = this.where(event);
      if (!at.inside) return;
      this.dragging = true;
      this.$el.setPointerCapture(event.pointerId);
      this.pick(at);
    },
    hover(event) {
      if (!this.chart) return;
      const at = this.where(event);
      if (this.dragging) this.pick(at);
      if (!at.inside) return this.leave();
      const { nx, ny, values, unit } = this.shown;
      const value = values[Math.round(at.u * (nx - 1)) * ny + Math.round(at.v * (ny - 1))];
      const place = this.point(at).map(short).join(", ");
      this.tell(value === null ? `${place}: no answer` : `${place}: ${short(value)} ${unit}`, at.pixel);
    },
    release() {
      if (this.dragging) this.$emit("settle");
      this.dragging = false;
    },
    step(event) {
      const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!move || !this.shown?.here) return;
      event.preventDefault();
      const { u, v } = this.shares(...this.shown.here);
      this.pick({ u: clip(u + 0.02 * move[0]), v: clip(v + 0.02 * move[1]) });
      this.$emit("settle");
    },
  },
};

// For each pixel of `count`, from the low end: the place below it among `points`, and how far it is from that.
function between(count, points) {
  return Array.from({ length: count }, (_, pixel) => {
    const at = ((pixel + 0.5) / count) * (points - 1);
    const below = Math.min(Math.floor(at), points - 2);
    return [below, at - below];
  });
}
