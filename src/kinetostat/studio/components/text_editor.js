// A text with its line numbers, of which one may be marked. What is typed is sent after a short pause.
const PAUSE = 250; // ms

export default {
  template: `<div class="text-editor"><div class="text-lines" aria-hidden="true" v-html="numbers"></div>
      <textarea v-model="written" :rows="lines.length" :cols="widest" :aria-label="label" :aria-invalid="line > 0"
        spellcheck="false" autocomplete="off" autocapitalize="off" wrap="off" @input="type" @keyup="place" @click="place">
      </textarea></div>`,
  props: { label: String, text: String, version: Number, line: Number },
  emits: ["edit", "place"],
  data() {
    return { written: this.text };
  },
  computed: {
    lines() {
      return this.written.split("\n");
    },
    widest() {
      return Math.max(20, ...this.lines.map((line) => line.length + 2));
    },
    numbers() {
      return this.lines.map((_, k) => (k + 1 === this.line ? `<span class="wrong">${k + 1}</span>` : k + 1)).join("\n");
    },
  },
  watch: {
    version() {
      this.written = this.text;
    },
  },
  unmounted() {
    clearTimeout(this.waiting);
  },
  methods: {
    type() {
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.$emit("edit", this.written), PAUSE);
    },
    place(event) {
      const line = this.written.slice(0, event.target.selectionStart).split("\n").length;
      if (line !== this.at) this.$emit("place", (this.at = line));
    },
  },
};
