// Unpacks the renderer and shows the machine in place of its picture; if anything is missing, the picture stays.
(async () => {
  const stage = document.getElementById("live");
  const packed = document.getElementById("live-data").textContent;
  const probe = document.createElement("canvas").getContext("webgl2");
  if (!probe || typeof DecompressionStream === "undefined") return;
  probe.getExtension("WEBGL_lose_context")?.loseContext();

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const follow = () => document.body.classList.toggle("body--dark", dark.matches);
  dark.addEventListener("change", follow);
  follow();

  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const { modules, looks, scene, overlays, swings } = JSON.parse(await new Response(stream).text());
  const address = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const imports = Object.fromEntries(Object.entries(modules).map(([name, text]) => [name, address(text)]));
  const map = document.createElement("script");
  map.type = "importmap";
  map.textContent = JSON.stringify({ imports });
  document.head.append(map);

  const { createApp } = await import("vue");
  const { default: MachineView } = await import("kinetostat-scene/machine_view.js");
  const there = new Set([...scene.solids, ...scene.labels, ...overlays].map((one) => one.layer));
  const words = {
    ellipsoids: "compliance ellipsoids", directions: "softest directions", deflection: "deflected shape",
    springs: "virtual springs", frames: "frames", labels: "leg numbers",
  };
  createApp({
    components: { MachineView },
    template: `<machine-view ref="view" :label="label" :hidden="hidden" :looks="looks"
        @swinging="moving = $event"></machine-view>
      <div class="live-tools" role="group" aria-label="views and layers">
        <button v-for="view in views" type="button" @click="$refs.view.look(view)">{{ view }}</button>
        <label v-for="[layer, text] in layers"><input type="checkbox" :checked="!hidden.includes(layer)"
          @change="toggle(layer)">{{ text }}</label>
        <label v-if="swings.length">vibration <select v-model="swing" @change="start"><option :value="null">none</option>
          <option v-for="one in swings" :value="one">{{ one.name }}</option></select></label>
        <button v-if="swing" type="button" @click="$refs.view.sway(!moving)">{{ moving ? "pause" : "play" }}</button>
      </div>`,
    data: () => ({
      label: stage.dataset.label,
      looks,
      swings: Object.freeze(swings),
      swing: null,
      moving: false,
      hidden: ["ellipsoids", "directions"],
      views: ["iso", "front", "side", "top"],
      layers: Object.entries(words).filter(([layer]) => there.has(layer)),
    }),
    mounted() {
      stage.closest("figure").classList.add("is-live");
      this.$nextTick(() => {
        this.$refs.view.show(scene);
        this.$refs.view.overlay(overlays, []);
      });
    },
    methods: {
      toggle(layer) {
        const hidden = new Set(this.hidden);
        if (!hidden.delete(layer)) hidden.add(layer);
        this.hidden = [...hidden];
      },
      start() {
        this.$refs.view.swing(this.swing ? this.swing.solids : []);
      },
    },
  }).mount(stage);
})();
