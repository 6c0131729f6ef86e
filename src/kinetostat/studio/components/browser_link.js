// What a page and the browser around it have in common: the keys of undo and redo.
const TEXTS = "textarea, [contenteditable], input:not([type=range], [type=checkbox], [type=radio], [readonly])";

export default {
  template: "<span hidden></span>",
  emits: ["undo", "redo"],
  mounted() {
    document.addEventListener("keydown", this.press);
  },
  unmounted() {
    document.removeEventListener("keydown", this.press);
  },
  methods: {
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
