// What a page and the browser around it have in common: the keys of undo and redo, the address, light and dark.
const TEXTS = "textarea, [contenteditable], input:not([type=range], [type=checkbox], [type=radio], [readonly])";

const PAUSE = 300; // ms: browsers refuse more than a few hundred addresses in ten seconds

export default {
  template: "<span hidden></span>",
  props: { address: String },
  emits: ["undo", "redo", "theme"],
  watch: {
    address() {
      clearTimeout(this.waiting);
      this.waiting = setTimeout(this.write, PAUSE);
    },
  },
  mounted() {
    document.addEventListener("keydown", this.press);
    if (this.address !== null) this.write();
  },
  unmounted() {
    document.removeEventListener("keydown", this.press);
    clearTimeout(this.waiting);
  },
  methods: {
    write() {
      history.replaceState(history.state, "", this.address ? "?" + this.address : location.pathname);
    },
    otherTheme() {
      // The theme that the system has is followed again, not fixed.
      const dark = !document.body.classList.contains("body--dark");
      this.$emit("theme", dark === matchMedia("(prefers-color-scheme: dark)").matches ? null : dark);
    },
    press(event) {
      if (!(event.ctrlKey || event.metaKey) || event.altKey || this.writing(event.target)) return;
      const key = event.key.toLowerCase();
      if (key !== "z" && key !== "y") return;
      event.preventDefault();
      this.$emit(key === "z" && !event.shiftKey ? "undo" : "redo");
    },
    writing(element) {
      // Text that is still being typed belongs to the browser's own undo; a number that the machine has taken does not.
      return element.matches?.(TEXTS) && (!element.matches(".quantity-text") || "typing" in element.dataset);
    },
  },
};
