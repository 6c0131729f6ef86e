// Handles by which a machine is pulled: arrows and rings at its platform, balls at its joints. Where a pull leads, the page decides.
import { THREE } from "nicegui-scene";

const COLOURS = { x: 0xd23b3b, y: 0x2c9c4a, z: 0x2d62d3, joint: 0xf4a51c };
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const SIZE = 0.16; // length of an arrow as a share of the distance at which the canvas is as high as wide
const BALL = 0.011;

function look(colour, opacity = 0.9) {
  return new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity, depthTest: false, toneMapped: false });
}

function part(geometry, material, pick) {
  const mesh = new THREE.Mesh(geometry, material);
  mesh.renderOrder = 10;
  mesh.material.visible = !pick;
  return mesh;
}

function arrow(axis) {
  const group = new THREE.Group();
  const material = look(COLOURS[axis]);
  group.add(part(new THREE.CylinderGeometry(0.016, 0.016, 0.62, 10).translate(0, 0.47, 0), material));
  group.add(part(new THREE.ConeGeometry(0.06, 0.2, 16).translate(0, 0.88, 0), material));
  group.add(part(new THREE.CylinderGeometry(0.11, 0.11, 0.9, 8).translate(0, 0.55, 0), look(0, 0), true));
  group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...AXES[axis]));
  return group;
}

function ring(axis) {
  const group = new THREE.Group();
  group.add(part(new THREE.TorusGeometry(0.66, 0.015, 8, 64), look(COLOURS[axis], 0.75)));
  group.add(part(new THREE.TorusGeometry(0.66, 0.06, 6, 40), look(0, 0), true));
  group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(...AXES[axis]));
  return group;
}

function ball() {
  const group = new THREE.Group();
  group.add(part(new THREE.SphereGeometry(1, 20, 14), look(COLOURS.joint, 0.55)));
  group.add(part(new THREE.SphereGeometry(2, 10, 8), look(0, 0), true));
  return group;
}

export class Handles {
  // `pulled(handle, amount or point)` is called while a handle is pulled, `settled()` when it is let go.
  constructor(world, pulled, settled) {
    this.root = new THREE.Group();
    world.add(this.root);
    this.items = new Map();
    Object.assign(this, { pulled, settled, held: null, over: null });
    this.caster = new THREE.Raycaster();
  }

  put(list) {
    const names = new Set();
    for (const { of, leg, point, axes } of list) {
      for (const axis of axes.length ? axes : [""]) {
        const name = [of, leg || axis].join(" ");
        names.add(name);
        let item = this.items.get(name);
        if (!item) {
          const object = axis.length === 1 ? arrow(axis) : axis ? ring(axis[1]) : ball();
          item = { name, of, leg, axis, object };
          object.traverse((mesh) => (mesh.userData.item = item));
          this.items.set(name, item);
          this.root.add(object);
        }
        item.object.position.set(...point);
      }
    }
    for (const [name, item] of this.items) {
      if (names.has(name)) continue;
      this.root.remove(item.object);
      this.items.delete(name);
    }
  }

  // Handles are as large on the screen wherever the camera is.
  scale(camera, size) {
    const slope = Math.tan((camera.fov * Math.PI) / 360);
    for (const { object, axis } of this.items.values()) {
      const apart = camera.position.distanceTo(object.position) * slope;
      object.scale.setScalar(axis ? SIZE * 2 * apart : Math.max(BALL * 2 * apart, 0.006 * (size ?? 0)));
    }
  }

  hit(camera, spot) {
    if (!this.root.visible) return null;
    this.caster.setFromCamera(spot, camera);
    const hits = this.caster.intersectObject(this.root, true);
    const near = hits.find((hit) => hit.object.userData.item.axis === "") ?? hits[0]; // a joint within a ring wins
    return near?.object.userData.item ?? null;
  }

  hover(item) {
    if (item === this.over) return false;
    for (const [each, light] of [[this.over, false], [item, true]]) {
      each?.object.traverse((mesh) => {
        if (mesh.material?.visible) mesh.material.opacity = light ? 1 : each.axis ? 0.85 : 0.55;
      });
    }
    this.over = item;
    return true;
  }

  grab(item, camera, spot) {
    const at = item.object.position.clone();
    const axis = new THREE.Vector3(...(AXES[item.axis.at(-1)] ?? AXES.z));
    this.held = { item, at, axis, camera, turned: 0 };
    this.held.from = this.reading(spot);
    return this.held.from !== null;
  }

  // Where the pointer is: along the axis (m), about it (rad), or the point in the joint's plane.
  reading(spot) {
    const { item, at, axis, camera } = this.held;
    this.caster.setFromCamera(spot, camera);
    const ray = this.caster.ray;
    if (item.axis.length === 1) {
      // The point of the axis that is nearest to the ray; where both are nearly parallel there is none to trust.
      const slant = axis.dot(ray.direction);
      if (1 - slant * slant < 1e-3) return null;
      const apart = ray.origin.clone().sub(at);
      return (axis.dot(apart) - slant * ray.direction.dot(apart)) / (1 - slant * slant);
    }
    const point = ray.intersectPlane(new THREE.Plane().setFromNormalAndCoplanarPoint(axis, at), new THREE.Vector3());
    if (!point || point.distanceTo(at) > 50 * camera.position.distanceTo(at)) return null;
    if (!item.axis) return point;
    const aside = new THREE.Vector3(...AXES[{ x: "y", y: "z", z: "x" }[item.axis[1]]]);
    const arm = point.sub(at);
    return Math.atan2(arm.dot(new THREE.Vector3().crossVectors(axis, aside)), arm.dot(aside));
  }

  pull(spot) {
    const now = this.reading(spot);
    const { item, from, at } = this.held;
    if (now === null) return;
    if (!item.axis) {
      const goal = at.clone().add(now).sub(from);
      return this.pulled(item, goal.toArray());
    }
    let amount = now - from;
    if (item.axis.length === 2) {
      // Beyond half a turn the angle goes on where it was.
      amount += 2 * Math.PI * Math.round((this.held.turned - amount) / (2 * Math.PI));
      this.held.turned = amount;
    }
    this.pulled(item, amount);
  }

  release() {
    if (this.held) this.settled();
    this.held = null;
  }
}
