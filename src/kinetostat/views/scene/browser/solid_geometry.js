// Triangles of the three shapes that a scene knows: turned, extruded, swept.
import { THREE } from "nicegui-scene";

const SEGMENTS = 40;
const SMOOTH = 0.8; // cosine between neighbouring faces above which an edge is shaded round
const KEPT = 2000;

export function geometryOf(cache, shape) {
  const key = JSON.stringify(shape);
  let geometry = cache.get(key);
  if (!geometry) {
    geometry = { turned, extruded, swept }[shape.kind](shape);
    if (cache.size > KEPT) cache.clear();
    cache.set(key, geometry);
  }
  return geometry;
}

function turned({ profile }) {
  const normals = [];
  for (let i = 0; i + 1 < profile.length; i++) {
    const dr = profile[i + 1][0] - profile[i][0];
    const dz = profile[i + 1][1] - profile[i][1];
    const size = Math.hypot(dr, dz) || 1;
    normals.push([dz / size, -dr / size]);
  }
  const at = (i, own) => {
    const other = normals[i];
    if (!other || other[0] * own[0] + other[1] * own[1] < SMOOTH) return own;
    const sum = [own[0] + other[0], own[1] + other[1]];
    const size = Math.hypot(...sum);
    return [sum[0] / size, sum[1] / size];
  };
  const positions = [];
  const directions = [];
  const faces = [];
  normals.forEach((own, i) => {
    const first = positions.length / 3;
    for (const [point, normal] of [
      [profile[i], at(i - 1, own)],
      [profile[i + 1], at(i + 1, own)],
    ]) {
      for (let k = 0; k <= SEGMENTS; k++) {
        const angle = (2 * Math.PI * k) / SEGMENTS;
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        positions.push(point[0] * c, point[0] * s, point[1]);
        directions.push(normal[0] * c, normal[0] * s, normal[1]);
      }
    }
    const row = SEGMENTS + 1;
    for (let k = 0; k < SEGMENTS; k++) {
      const a = first + k;
      faces.push(a, a + 1, a + row, a + 1, a + row + 1, a + row);
    }
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute(directions, 3));
  geometry.setIndex(faces);
  return geometry;
}

function extruded({ outline, height, chamfer }) {
  const flat = new THREE.Shape(outline.map(([x, y]) => new THREE.Vector2(x, y)));
  const geometry = new THREE.ExtrudeGeometry(flat, {
    depth: height - 2 * chamfer,
    bevelEnabled: chamfer > 0,
    bevelThickness: chamfer,
    bevelSize: chamfer,
    bevelOffset: -chamfer,
    bevelSegments: 2,
    curveSegments: 1,
  });
  return geometry.translate(0, 0, chamfer);
}

class Polyline extends THREE.Curve {
  constructor(points, closed) {
    super();
    this.points = points;
    this.closed = closed;
  }
  getPoint(share, target = new THREE.Vector3()) {
    const spans = this.closed ? this.points.length : this.points.length - 1;
    const at = Math.min(share, 1) * spans;
    const i = Math.min(Math.floor(at), spans - 1);
    const next = this.points[(i + 1) % this.points.length];
    return target.copy(this.points[i]).lerp(next, at - i);
  }
}

function swept({ path, radius, closed }) {
  const points = path.map((point) => new THREE.Vector3(...point));
  const curve = new Polyline(points, closed);
  return new THREE.TubeGeometry(curve, closed ? points.length : points.length - 1, radius, 10, closed);
}
