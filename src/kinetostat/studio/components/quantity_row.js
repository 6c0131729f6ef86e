// One number: its name, its value as text with a unit, and a slider. The server says what positions mean.
export default {
  template: `<div class="quantity" :class="{wrong: complaint}">
      <label class="quantity-head"><span class="quantity-name" :title="meaning">{{label}}</span>
        <input class="quantity-text" type="text" spellcheck="false" autocomplete="off" :aria-label="label + ', value with unit'"
          :aria-invalid="!!complaint" :data-typing="written !== text || null" v-model="written" @input="type"
          @blur="commit" @keydown.enter="commit" @keydown.escape="cancel"></label>
      <input v-if="slides" class="quantity-slider" type="range" min="0" :max="steps" step="1" :value="at"
        :style="{'--share': (100 * at) / steps + '%'}" :aria-label="label" :aria-valuetext="text"
        @input="slide" @change="settle">
      <p v-if="complaint" class="quantity-problem" role="alert">{{complaint}}</p></div>`,
  props: {
    label: String, meaning: String, text: String, position: Number, steps: Number, slides: Boolean, problem: String, taken: Number,
  },
  emits: ["slide", "settle", "write"],
  data() {
    return { written: this.text, at: this.position, editing: false, dragging: false, dismissed: false };
  },
  computed: {
    complaint() {
      return this.dismissed ? "" : this.problem;
    },
  },
  watch: {
    text(value) {
      if (!this.editing) this.written = value;
    },
    taken() {
      if (!this.editing) this.written = this.text; // what was typed may be written in another way, or mean the same
    },
    position(value) {
      if (!this.dragging) this.at = value;
    },
    problem() {
      this.dismissed = false;
    },
  },
  methods: {
    type() {
      this.editing = this.written !== this.text;
      if (!this.editing) this.dismissed = true;
    },
    slide(event) {
      this.dragging = true;
      this.at = Number(event.target.value);
      this.$emit("slide", this.at);
    },
    settle() {
      this.$emit("settle");
      this.dragging = false;
    },
    commit() {
      this.editing = false;
      this.dismissed = false;
      if (this.written !== this.text) this.$emit("write", this.written);
    },
    cancel(event) {
      this.written = this.text;
      this.editing = false;
      this.dismissed = true;
      event.target.blur();
    },
  },
};
