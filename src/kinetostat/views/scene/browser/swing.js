// A shape that swings between its two ends, over the machine at rest; the page says which, and nothing while it swings.
import { THREE } from "nicegui-scene";
import { geometryOf } from "kinetostat-scene/solid_geometry.js";

const PERIOD = 1600; // ms of a swing, whatever its frequency
const LONGEST = 200; // ms between two pictures that count, so that a pause of the page is no leap

export class Swing {
  constructor(world) {
    this.root = new THREE.Group();
    world.add(this.root);
    this.parts = [];
    this.phase = 0;
  }

  get shown() {
    return this.parts.length > 0;
  }

  put(solids, material) {
    for (const { mesh, rest } of this.parts) {
      this.root.remove(mesh);
      if (rest) mesh.geometry.dispose();
    }
    if (!solids.length) this.phase = 0;
    this.cache ??= new Map();
    this.parts = solids.map((solid) => {
      const swept = solid.shape.kind === "swept";
      const mesh = new THREE.Mesh(geometryOf(swept ? new Map() : this.cache, solid.shape), material);
      mesh.matrixAutoUpdate = false;
      mesh.frustumCulled = false; // its points move out of the sphere that was made for them
      mesh.renderOrder = 2;
      this.root.add(mesh);
      return { mesh, solid, rest: swept ? mesh.geometry.attributes.position.array.slice() : null };
    });
    this.move();
  }

  step(time) {
    this.phase += (2 * Math.PI * Math.min(time - (this.time ?? time), LONGEST)) / PERIOD;
    this.time = time;
    this.move();
  }

  pause() {
    this.time = undefined;
  }

  get share() {
    return Math.cos(this.phase);
  }

  move() {
    for (const part of this.parts) (part.rest ? this.bend : this.turn).call(this, part);
  }

  // Every ring of points about the path of a wire moves with its point of the path.
  bend({ mesh, solid, rest }) {
    const position = mesh.geometry.attributes.position;
    const around = position.count / solid.ends.length;
    for (let k = 0; k < position.count; k++) {
      const shift = solid.ends[Math.floor(k / around)];
      for (let c = 0; c < 3; c++) position.array[3 * k + c] = rest[3 * k + c] + this.share * shift[c];
    }
    position.needsUpdate = true;
  }

  // The parabola through its three places: a turn is a little more than straight.
  turn({ mesh, solid }) {
    const [there, back] = solid.ends;
    const p = solid.place.map((middle, k) => {
      const [odd, even] = [(there[k] - back[k]) / 2, (there[k] + back[k]) / 2 - middle];
      return middle + this.share * odd + this.share ** 2 * even;
    });
    mesh.matrix.set(p[0], p[3], p[6], p[9], p[1], p[4], p[7], p[10], p[2], p[5], p[8], p[11], 0, 0, 0, 1);
  }
}
