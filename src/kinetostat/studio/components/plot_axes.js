// What plots share: a canvas that is drawn again when its size or the colours of the page change, ticks and labels.
import { colour, onTheme } from "kinetostat-scene/theme.js";

export const FONT = '11px Roboto, "Segoe UI", sans-serif';

export const plot = {
  props: { label: String },
  mounted() {
    this.canvas = this.$el.querySelector("canvas");
    this.tip = this.$el.querySelector(".plot-tip");
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.$el);
    this.themes = onTheme(() => this.draw());
  },
  beforeUnmount() {
    this.observer.disconnect();
    this.themes.disconnect();
  },
  methods: {
    tell() {
      this.$el.dataset.shown = Number(this.$el.dataset.shown ?? 0) + 1;
    },
  },
};

export function prepare(canvas, root) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const { clientWidth: width, clientHeight: height } = root;
  if (!width || !height) return null;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = FONT;
  return { pen, width, height, ratio };
}

export function niceTicks(low, high, wanted) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((s) => s * power).find((s) => s >= rough * 0.999);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) ticks.push(i * step);
  return ticks;
}

export function logTicks(low, high, wanted) {
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

export function frame(pen, box, ticks, labels) {
  pen.strokeStyle = colour("line-strong");
  pen.fillStyle = colour("ink-soft");
  pen.lineWidth = 1;
  pen.strokeRect(box.x + 0.5, box.y + 0.5, box.width - 1, box.height - 1);
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const [at, text] of ticks.x) {
    pen.fillRect(Math.round(at), box.y + box.height, 1, 4);
    pen.fillText(text, at, box.y + box.height + 6);
  }
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const [at, text] of ticks.y) {
    pen.fillRect(box.x - 4, Math.round(at), 4, 1);
    pen.fillText(text, box.x - 7, at);
  }
  pen.fillStyle = colour("ink");
  pen.textAlign = "center";
  pen.textBaseline = "bottom";
  pen.fillText(labels.x, box.x + box.width / 2, box.bottom - 2);
  pen.save();
  pen.translate(box.left + 11, box.y + box.height / 2);
  pen.rotate(-Math.PI / 2);
  pen.textBaseline = "middle";
  pen.fillText(labels.y, 0, 0);
  pen.restore();
}
