// Designs or modes as rows, sorted by the column that was asked for; a button in each row picks it.
export default {
  template: `<div class="design-table" role="region" tabindex="0" :aria-label="label"><table class="figures">
      <thead><tr><th></th><th v-for="(name, k) in names" :key="k" scope="col" :aria-sort="k === by ? (down ? 'descending' : 'ascending') : null">
        <button type="button" :class="{sorted: k === by}" @click="sort(k)">{{name}} <span aria-hidden="true">{{arrow(k)}}</span></button></th></tr></thead>
      <tbody><tr v-for="n in order" :key="n" :class="{chosen: n === chosen}" @click="$emit('pick', n)">
        <th scope="row"><button type="button" :aria-label="action + ' ' + (n + 1)" :aria-pressed="n === chosen"
          @click.stop="$emit('pick', n)">{{n + 1}}</button>{{n === knee ? ' knee' : ''}}</th>
        <td v-for="(text, k) in texts[n]" :key="k">{{text}}</td></tr></tbody></table></div>`,
  props: { label: String, action: String, names: Array, values: Array, texts: Array, knee: Number, chosen: Number },
  emits: ["pick"],
  data() {
    return { by: 0, down: false };
  },
  computed: {
    order() {
      const sign = this.down ? -1 : 1;
      const places = this.values.map((_, n) => n);
      return places.sort((a, b) => sign * (this.values[a][this.by] - this.values[b][this.by]) || a - b);
    },
  },
  methods: {
    sort(k) {
      this.down = k === this.by && !this.down;
      this.by = k;
    },
    arrow(k) {
      return k !== this.by ? "" : this.down ? "↓" : "↑";
    },
  },
};
