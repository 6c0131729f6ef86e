// Draws scenes of solids: light, materials, camera and labels live here; what there is to see does not.
import { CSS2DObject, CSS2DRenderer, OrbitControls, THREE } from "nicegui-scene";
import { Handles } from "kinetostat-scene/handles.js";
import { geometryOf } from "kinetostat-scene/solid_geometry.js";
import { Swing } from "kinetostat-scene/swing.js";
import { isDark, onTheme } from "kinetostat-scene/theme.js";

const THEMES = {
  light: { sky: 0xf7f9fb, ground: 0xe3e7ec, grid: 0x9aa6b4, gridOpacity: 0.32, shadow: 0.26, light: 1.0 },
  dark: { sky: 0x1b222c, ground: 0x11161d, grid: 0x6b7a8c, gridOpacity: 0.28, shadow: 0.5, light: 0.72 },
};
const VIEWS = { iso: [1.0, -1.35, 0.75], front: [0, -1, 0.02], side: [1, 0, 0.02], top: [0, -0.02, 1] };
const HANDLES = "handles"; // the layer of what can be pulled
const TOUCH = "pan-y"; // a finger turns the machine by moving aside, and scrolls the page by moving up or down
const FILLED = 0.84; // share of the canvas across which the machine may reach
const SHIFTS = [0, -1, 1, -2, 2, -3, 3, -4, 4]; // by which names of legs may move, in halves of their height
const UNLIT = new Set(["frames", "directions", "ellipsoids", "deflection"]);

const SLOW = 120; // ms of a frame from which pictures are coarse while something moves, and fine at rest
const COARSE = 0.5; // share of the pixels across
const AT_REST = 500; // ms without movement
const FINE = 1.5; // where edges are not smoothed otherwise

function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export default {
  template: `<div class="machine-view"><canvas tabindex="0" role="img" :aria-label="label"
      @keydown="turn"></canvas><div class="machine-labels"></div></div>`,
  props: { label: String, hidden: Array, looks: Object },
  emits: ["pull", "settle", "swinging", "drawn"],
  mounted() {
    const canvas = this.$el.querySelector("canvas");
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !drawsInSoftware(), alpha: false });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.labelRenderer = new CSS2DRenderer({ element: this.$el.querySelector(".machine-labels") });
    this.world = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.handles = new Handles(
      this.world,
      (item, goal) => this.$emit("pull", { of: item.of, leg: item.leg, axis: item.axis, goal, start: this.pullStarts }),
      () => this.$emit("settle"),
    );
    this.$el.handleAt = this.handleAt;
    this.$el.addEventListener("pointerdown", this.press, true); // before the camera's controls
    this.$el.addEventListener("touchstart", this.keepTouch, { capture: true, passive: false });
    canvas.addEventListener("pointermove", this.hover);
    canvas.addEventListener("pointerleave", () => this.link(""));
    this.listening = new AbortController();
    const over = (event) => this.link(event.target.closest?.("[data-leg]")?.dataset.leg ?? "");
    document.addEventListener("pointerover", over, { signal: this.listening.signal });
    this.controls = new OrbitControls(this.camera, canvas);
    canvas.style.touchAction = TOUCH; // the controls have forbidden all of it
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => (this.view = null));
    this.slow = drawsInSoftware();
    this.finest = this.slow ? FINE : 1;
    this.sharpness(this.slow ? COARSE : 1);
    this.controls.maxPolarAngle = Math.PI * 0.96;
    this.materials = {};
    for (const [name, look] of Object.entries(this.looks)) {
      const transparent = look.opacity < 1;
      this.materials[name] = new THREE.MeshStandardMaterial({
        ...look,
        transparent,
        depthWrite: !transparent,
        side: transparent ? THREE.FrontSide : THREE.DoubleSide,
      });
    }
    this.geometries = new Map();
    this.groups = {};
    this.mode = new Swing(this.world);
    this.light();
    this.theme();
    this.themes = onTheme(() => this.theme());
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.$el);
    this.resize();
    canvas.addEventListener("webglcontextrestored", () => this.draw());
  },
  beforeUnmount() {
    clearTimeout(this.resting);
    this.swings = false;
    this.listening.abort();
    this.observer.disconnect();
    this.themes.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
  },
  watch: {
    hidden() {
      this.hide();
      this.draw();
    },
  },
  methods: {
    light() {
      const room = new THREE.Scene();
      const panel = (x, y, z, w, h, power) => {
        const lamp = new THREE.Mesh(
          new THREE.PlaneGeometry(w, h),
          new THREE.MeshBasicMaterial({ color: new THREE.Color(power, power, power), side: THREE.DoubleSide }),
        );
        lamp.position.set(x, y, z);
        lamp.lookAt(0, 0, 0);
        room.add(lamp);
      };
      const walls = new THREE.Mesh(
        new THREE.BoxGeometry(20, 20, 20),
        new THREE.MeshBasicMaterial({ color: 0x6f757d, side: THREE.BackSide }),
      );
      room.add(walls);
      panel(0, 0, 9, 9, 9, 5.5);
      panel(-8, -6, 4, 6, 5, 4);
      panel(8, -4, 3, 5, 6, 2.6);
      panel(0, 9, 3, 8, 4, 1.6);
      const generator = new THREE.PMREMGenerator(this.renderer);
      this.world.environment = generator.fromScene(room, 0.03).texture;
      generator.dispose();
      this.sun = new THREE.DirectionalLight(0xffffff, 1.7);
      this.sun.castShadow = true;
      this.sun.shadow.mapSize.set(2048, 2048);
      this.sun.shadow.radius = 5;
      this.sun.shadow.bias = -0.0004;
      this.sun.shadow.normalBias = 0.01;
      this.world.add(this.sun, this.sun.target);
      const plane = new THREE.CircleGeometry(1, 96);
      this.floor = new THREE.Mesh(plane, new THREE.ShadowMaterial({ opacity: 0.25 }));
      this.floor.receiveShadow = true;
      this.world.add(this.floor);
    },
    theme() {
      const look = THEMES[isDark() ? "dark" : "light"];
      this.world.background = new THREE.Color(look.sky);
      this.world.fog = null;
      this.world.environmentIntensity = look.light;
      this.sun.intensity = 1.9 * look.light;
      this.floor.material.opacity = look.shadow;
      this.makeGrid();
      this.draw();
    },
    makeGrid() {
      if (this.grid) {
        this.world.remove(this.grid);
        this.grid.geometry.dispose();
      }
      const size = this.size;
      if (!size) return;
      const look = THEMES[isDark() ? "dark" : "light"];
      const step = 10 ** Math.round(Math.log10(size / 8));
      const count = Math.ceil((1.6 * size) / step);
      const reach = count * step;
      const corners = [];
      const colours = [];
      const ink = new THREE.Color(look.grid);
      const paper = new THREE.Color(look.sky);
      const fade = (x, y) => {
        const near = Math.max(0, 1 - Math.hypot(x, y) / reach);
        return ink.clone().lerp(paper, 1 - look.gridOpacity * near * 2.2);
      };
      for (let i = -count; i <= count; i++) {
        for (let j = -count; j < count; j++) {
          for (const [ax, ay, bx, by] of [
            [i * step, j * step, i * step, (j + 1) * step],
            [j * step, i * step, (j + 1) * step, i * step],
          ]) {
            corners.push(ax, ay, 0, bx, by, 0);
            colours.push(...fade(ax, ay).toArray(), ...fade(bx, by).toArray());
          }
        }
      }
      const lines = new THREE.BufferGeometry();
      lines.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
      lines.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
      this.grid = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ vertexColors: true, toneMapped: false }));
      this.grid.position.copy(this.floor.position);
      this.world.add(this.grid);
    },
    show(scene) {
      this.number = scene.number;
      this.put("machine", scene.solids, scene.labels);
      if (scene.handles) this.handles.put(scene.handles);
      const first = this.size !== scene.size && (!this.size || Math.abs(this.size / scene.size - 1) > 0.6);
      const centre = new THREE.Vector3(...scene.centre);
      if (first || scene.fit) {
        this.size = scene.size;
        this.centre = centre;
        this.look("iso");
        this.makeGrid();
      }
      this.floor.position.set(this.centre.x, this.centre.y, scene.floor);
      this.floor.scale.setScalar(3 * this.size);
      if (this.grid) this.grid.position.set(this.centre.x, this.centre.y, scene.floor - 0.0005 * this.size);
      const reach = 0.9 * this.size;
      this.sun.position.copy(this.centre).add(new THREE.Vector3(-0.55, -0.75, 1.5).multiplyScalar(this.size * 1.6));
      this.sun.target.position.copy(this.centre);
      Object.assign(this.sun.shadow.camera, {
        left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * this.size, far: 6 * this.size,
      });
      this.sun.shadow.normalBias = 0.004 * this.size;
      this.sun.shadow.camera.updateProjectionMatrix();
      this.renderer.shadowMap.needsUpdate = true;
      this.draw();
    },
    overlay(solids, labels) {
      this.put("overlay", solids, labels);
      this.draw();
    },
    // Another machine, or this one as it was, as a translucent shape behind the present one; none to remove it.
    ghost(solids) {
      this.put("ghost", solids, []);
      this.draw();
    },
    // A shape that swings over the machine, none to end it. Nothing moves by itself for who wants less motion.
    swing(solids, moving) {
      this.mode.put(solids, this.materials.ghost);
      this.hide();
      const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.sway(solids.length > 0 && (moving ?? !still));
      this.draw();
    },
    sway(moving) {
      const began = moving && !this.swings;
      this.swings = moving;
      this.$el.dataset.swings = this.mode.shown ? String(moving) : "";
      this.$emit("swinging", moving);
      if (began) requestAnimationFrame(this.onward);
      if (!moving) this.mode.pause();
    },
    onward(time) {
      if (!this.swings) return;
      if (!this.drawing) {
        this.mode.step(time);
        this.$el.dataset.share = this.mode.share.toFixed(4);
        this.draw();
      }
      requestAnimationFrame(this.onward);
    },
    put(name, solids, labels) {
      const group = (this.groups[name] ??= { root: new THREE.Group(), meshes: new Map() });
      if (!group.root.parent) this.world.add(group.root);
      const old = group.meshes;
      group.meshes = new Map();
      for (const solid of solids) {
        let mesh = old.get(solid.name);
        old.delete(solid.name);
        if (!mesh) {
          mesh = new THREE.Mesh();
          mesh.matrixAutoUpdate = false;
          group.root.add(mesh);
        }
        mesh.geometry = geometryOf(this.geometries, solid.shape);
        mesh.userData.leg = name === "machine" ? solid.leg : "";
        mesh.userData.material = solid.material;
        mesh.material = this.material(mesh);
        const unlit = UNLIT.has(solid.layer);
        mesh.castShadow = !unlit && !mesh.material.transparent;
        mesh.receiveShadow = !unlit;
        mesh.renderOrder = mesh.material.transparent ? 2 : 0;
        mesh.userData.layer = solid.layer;
        const p = solid.place;
        mesh.matrix.set(p[0], p[3], p[6], p[9], p[1], p[4], p[7], p[10], p[2], p[5], p[8], p[11], 0, 0, 0, 1);
        group.meshes.set(solid.name, mesh);
      }
      for (const mesh of old.values()) group.root.remove(mesh);
      for (const label of group.labels ?? []) group.root.remove(label);
      group.labels = labels.map((label) => {
        const text = document.createElement("span");
        text.textContent = label.text;
        text.className = `machine-label machine-label-${label.layer}`;
        const object = new CSS2DObject(text);
        object.position.set(...label.point);
        object.userData.layer = label.layer;
        group.root.add(object);
        return object;
      });
      this.hide();
    },
    material(mesh) {
      const name = mesh.userData.material;
      if (!mesh.userData.leg || mesh.userData.leg !== this.linked) return this.materials[name];
      const lit = `${name}, lit`;
      if (!this.materials[lit]) {
        this.materials[lit] = this.materials[name].clone();
        this.materials[lit].emissive = new THREE.Color(0xffb000);
        this.materials[lit].emissiveIntensity = 0.55;
      }
      return this.materials[lit];
    },
    // Lights a leg in the picture, and marks everything on the page that is about it.
    link(leg) {
      if (leg === (this.linked ?? "")) return;
      this.linked = leg;
      for (const mesh of this.groups.machine?.meshes.values() ?? []) mesh.material = this.material(mesh);
      for (const row of document.querySelectorAll("[data-leg]")) row.classList.toggle("linked", row.dataset.leg === leg);
      this.$el.dataset.linked = leg;
      this.draw();
    },
    spot(event) {
      const frame = this.$el.getBoundingClientRect();
      const [u, v] = [(event.clientX - frame.left) / frame.width, (event.clientY - frame.top) / frame.height];
      return new THREE.Vector2(2 * u - 1, 1 - 2 * v);
    },
    hover(event) {
      if (event.buttons || this.handles.held || this.looking) return;
      this.looking = true; // once a frame is often enough
      const spot = this.spot(event);
      requestAnimationFrame(() => {
        this.looking = false;
        const item = this.handles.hit(this.camera, spot);
        if (this.handles.hover(item)) this.draw();
        this.$el.style.cursor = item ? "grab" : "";
        this.link(item?.leg || this.legAt(spot));
      });
    },
    legAt(spot) {
      this.caster ??= new THREE.Raycaster();
      this.caster.setFromCamera(spot, this.camera);
      const meshes = [...(this.groups.machine?.meshes.values() ?? [])].filter((mesh) => mesh.visible);
      return this.caster.intersectObjects(meshes, false)[0]?.object.userData.leg ?? "";
    },
    keepTouch(event) {
      const [finger] = event.touches;
      if (event.touches.length === 1 && this.handles.hit(this.camera, this.spot(finger))) event.preventDefault();
    },
    press(event) {
      const item = event.button === 0 && this.handles.hit(this.camera, this.spot(event));
      if (!item || !this.handles.grab(item, this.camera, this.spot(event))) return;
      event.stopPropagation();
      event.preventDefault();
      this.pullStarts = (this.pullStarts ?? 0) + 1;
      this.$el.style.cursor = "grabbing";
      const ended = new AbortController();
      const options = { signal: ended.signal };
      const release = () => {
        ended.abort();
        this.handles.release();
        this.$el.style.cursor = "";
      };
      window.addEventListener("pointermove", (moved) => this.handles.pull(this.spot(moved)), options);
      for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, release, options);
    },
    // Where a handle is on the page; for tests.
    handleAt(name) {
      const item = this.handles.items.get(name);
      const grip = { 0: [0, 0, 0], 1: [0, 0.85, 0], 2: [0.66, 0, 0] }[item.axis.length];
      item.object.updateWorldMatrix(true, false);
      const point = new THREE.Vector3(...grip).applyMatrix4(item.object.matrixWorld).project(this.camera);
      const frame = this.$el.getBoundingClientRect();
      return [frame.left + ((point.x + 1) / 2) * frame.width, frame.top + ((1 - point.y) / 2) * frame.height];
    },
    // Moves names of legs up or down that would lie on other labels, the nearest to the camera first; letters of frames stay.
    spreadLabels() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      const shown = Object.values(this.groups).flatMap((group) => group.labels).filter((label) => label.visible);
      const places = shown.map((label) => {
        const at = label.getWorldPosition(new THREE.Vector3()).project(this.camera), { userData } = label;
        userData.size ??= [label.element.offsetWidth, label.element.offsetHeight];
        const [wide, high] = userData.size, fixed = userData.layer === "frames";
        return { label, fixed, wide, high, near: fixed ? -2 : at.z, x: ((at.x + 1) / 2) * width, y: ((1 - at.y) / 2) * height };
      });
      const placed = [];
      for (const place of places.sort((a, b) => a.near - b.near)) {
        const isFree = (shift) => placed.every((other) => Math.abs(place.x - other.x) >= (place.wide + other.wide) / 2
          || Math.abs(place.y + shift - other.y) >= (place.high + other.high) / 2);
        const step = place.high / 2, shift = place.fixed ? 0 : (SHIFTS.find((steps) => isFree(steps * step)) ?? 0) * step;
        place.label.element.style.marginTop = `${shift}px`;
        placed.push({ ...place, y: place.y + shift });
      }
    },
    // Saves the picture as it is, labels included, as a PNG of twice its size on the page.
    save(name) {
      const ratio = this.renderer.getPixelRatio();
      const shown = this.handles.root.visible;
      this.handles.root.visible = false;
      this.renderer.setPixelRatio(2);
      this.renderer.render(this.world, this.camera);
      const { domElement } = this.renderer;
      const sheet = document.createElement("canvas");
      [sheet.width, sheet.height] = [domElement.width, domElement.height];
      const pen = sheet.getContext("2d");
      pen.drawImage(domElement, 0, 0); // at once: the browser clears what it has shown
      pen.scale(sheet.width / this.$el.clientWidth, sheet.height / this.$el.clientHeight);
      for (const text of this.$el.querySelectorAll(".machine-label")) this.write(pen, text);
      this.renderer.setPixelRatio(ratio);
      this.handles.root.visible = shown;
      this.render(); // at once: a canvas is empty after its size has changed
      this.draw();
      sheet.toBlob((blob) => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = `${name}.png`;
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 1000);
      });
    },
    write(pen, text) {
      const style = getComputedStyle(text);
      if (style.display === "none") return;
      const [frame, box] = [this.$el.getBoundingClientRect(), text.getBoundingClientRect()];
      const [x, y] = [box.left - frame.left, box.top - frame.top];
      if (parseFloat(style.borderWidth)) {
        pen.beginPath();
        pen.roundRect(x, y, box.width, box.height, box.height / 2);
        [pen.fillStyle, pen.strokeStyle] = [style.backgroundColor, style.borderColor];
        pen.fill();
        pen.stroke();
      }
      pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
      [pen.textAlign, pen.textBaseline, pen.fillStyle] = ["center", "middle", style.color];
      pen.fillText(text.textContent, x + box.width / 2, y + box.height / 2);
    },
    hide() {
      const hidden = new Set(this.hidden ?? []);
      this.handles.root.visible = !hidden.has(HANDLES);
      for (const group of Object.values(this.groups)) {
        for (const object of [...group.meshes.values(), ...group.labels]) {
          const { layer } = object.userData;
          object.visible = !hidden.has(layer) && !(layer === "deflection" && this.mode.shown);
        }
      }
      this.renderer.shadowMap.needsUpdate = true;
    },
    // Looks from one of the VIEWS so that the machine just fits, and again when the canvas changes, until somebody turns it.
    look(view) {
      if (!this.centre) return;
      this.view = view;
      const back = new THREE.Vector3(...VIEWS[view]).normalize();
      const right = new THREE.Vector3().crossVectors(this.camera.up, back).normalize();
      const up = new THREE.Vector3().crossVectors(back, right);
      const whole = Math.tan((this.camera.fov * Math.PI) / 360), slope = whole * FILLED;
      const style = getComputedStyle(this.$el); // shares of the height on which words and buttons stand
      const [over, under] = ["--over", "--under"].map((name) => Number(style.getPropertyValue(name)) || 0);
      const [aside, wide] = this.span(right, back, slope * this.camera.aspect);
      const [above, high] = this.span(up, back, slope * (1 - over - under));
      const distance = Math.max(wide, high);
      const target = this.centre.clone().addScaledVector(right, aside).addScaledVector(up, above + (over - under) * whole * distance);
      this.camera.position.copy(target).addScaledVector(back, distance);
      this.camera.near = distance / 100;
      this.camera.far = distance * 20;
      this.camera.updateProjectionMatrix();
      this.controls.target.copy(target);
      this.controls.update();
      this.draw();
    },
    // Where the camera must stand along an axis, and how far back, for the machine to lie between the slopes +-slope.
    span(axis, back, slope) {
      let [low, high] = [-Infinity, -Infinity];
      for (const mesh of this.groups.machine.meshes.values()) {
        mesh.geometry.computeBoundingBox();
        const { min, max } = mesh.geometry.boundingBox;
        for (let corner = 0; corner < 8; corner++) {
          const point = new THREE.Vector3(corner & 1 ? min.x : max.x, corner & 2 ? min.y : max.y, corner & 4 ? min.z : max.z);
          point.applyMatrix4(mesh.matrix).sub(this.centre);
          const [along, near] = [point.dot(axis), slope * point.dot(back)];
          high = Math.max(high, near + along);
          low = Math.max(low, near - along);
        }
      }
      return [(high - low) / 2, (high + low) / (2 * slope)];
    },
    turn(event) {
      const step = Math.PI / 24;
      const moves = { ArrowLeft: [-step, 0, 1], ArrowRight: [step, 0, 1], ArrowUp: [0, -step, 1], ArrowDown: [0, step, 1] };
      const move = { ...moves, "+": [0, 0, 0.9], "-": [0, 0, 1.1] }[event.key];
      if (!move) return;
      event.preventDefault();
      this.view = null;
      const arm = this.camera.position.clone().sub(this.controls.target);
      const polar = new THREE.Spherical().setFromVector3(new THREE.Vector3(arm.x, arm.z, -arm.y));
      polar.theta += move[0];
      polar.phi = Math.min(Math.max(polar.phi + move[1], 0.02), Math.PI - 0.05);
      polar.radius *= move[2];
      const turned = new THREE.Vector3().setFromSpherical(polar);
      this.camera.position.copy(this.controls.target).add(new THREE.Vector3(turned.x, -turned.z, turned.y));
      this.controls.update();
      this.draw();
    },
    resize() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      if (!width || !height) return;
      this.renderer.setSize(width, height, false);
      this.labelRenderer.setSize(width, height);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      if (this.view) this.look(this.view);
      this.render(); // at once: a canvas is empty after its size has changed
    },
    draw() {
      this.wanted = true;
      this.$el.dataset.rest = "";
      clearTimeout(this.resting);
      if (this.drawing) return;
      this.drawing = true;
      requestAnimationFrame(() => this.frame(this.slow ? COARSE : this.finest));
    },
    frame(sharpness) {
      this.wanted = false;
      const number = this.number;
      const started = performance.now();
      this.sharpness(sharpness);
      this.render();
      const gl = this.renderer.getContext();
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      const look = () => {
        if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED && !gl.isContextLost()) return setTimeout(look, 10);
        gl.deleteSync(fence);
        if (number !== this.told) this.$emit("drawn", (this.told = number));
        const took = performance.now() - started;
        if (sharpness < this.finest || took > SLOW) this.slow = took > SLOW * 0.5;
        setTimeout(() => this.rest(sharpness), this.slow ? took / 2 : 0); // leave the page time for itself
      };
      look();
    },
    rest(sharpness) {
      this.drawing = false;
      if (this.wanted) return this.draw();
      if (sharpness === this.finest) return (this.$el.dataset.rest = "fine");
      this.resting = setTimeout(() => {
        this.drawing = true;
        this.frame(this.finest);
      }, AT_REST);
    },
    sharpness(share) {
      const ratio = Math.min(window.devicePixelRatio || 1, 2) * share;
      if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    },
    render() {
      this.handles.scale(this.camera, this.size);
      this.renderer.render(this.world, this.camera);
      this.labelRenderer.render(this.world, this.camera);
      this.spreadLabels();
      this.$el.dataset.drawn = Number(this.$el.dataset.drawn ?? 0) + 1;
      this.$el.dataset.solids = this.groups.machine?.meshes.size ?? 0;
    },
  },
};
