// The machine in three dimensions: shaded bodies on a plain canvas, from far to near, seen from a camera that turns.
// `drawing` says which points the bodies join; the points themselves come from the machine's program at each pose.
function pictureOf(canvas, { drawing, planar, length }, first) {
  const view = { azimuth: planar ? -Math.PI / 2 : -0.9, elevation: planar ? Math.PI / 2 : 0.42, zoom: 1 };
  const start = { ...view }, SIDES = 14, LIGHT = unit([0.35, -0.5, 0.8]);
  const PLATES = { base: { rim: 3.6, thick: 1.7, away: 2.3 }, platform: { rim: 2.9, thick: 1.3, away: 2.3 } };
  const radius = drawing.radius;
  let middle = [0, 0, 0], reach = 1, places = null, corners = [];

  function unit(a) { const size = Math.hypot(...a); return a.map((value) => value / size); }
  const plus = (a, b, factor = 1) => a.map((value, k) => value + factor * b[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const across = (u) => unit(cross(u, Math.abs(u[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const mean = (points) => points[0].map((_, k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);
  const triple = (k) => [places[k], places[k + 1], places[k + 2]];
  const tool = () => triple(first);
  const point = (k) => triple(first + 12 + 3 * k);

  // The size of the picture: from the points at the pose where the page opened, so that it stays while the machine moves.
  function measure(at) {
    places = at;
    const rails = drawing.legs.flatMap((leg) => leg.rails.flatMap(({ ends }) => ends));
    const seen = [tool(), ...Array.from({ length: drawing.points }, (_, k) => point(k)), ...rails].filter((p) => p.every(Number.isFinite));
    if (!seen.length) { reach = length; return; }
    const [low, high] = [Math.min, Math.max].map((end) => [0, 1, 2].map((k) => end(...seen.map((p) => p[k]))));
    middle = mean([low, high]);
    reach = Math.hypot(...plus(high, low, -1)) / 2 || length;
    corners = seen;
  }
  // Pixels from the middle to the reach, so that all points of the first pose fit with what surrounds them, seen as at first.
  function fitting(box, far) {
    const [ca, sa, ce, se] = [Math.cos(start.azimuth), Math.sin(start.azimuth), Math.cos(start.elevation), Math.sin(start.elevation)];
    const edge = (4.5 * radius) / reach; // of plates, beyond the joints
    let [wide, high] = [0.3, 0.3];
    for (const p of corners) {
      const d = plus(p, middle, -1).map((value) => value / reach), out = ca * d[0] + sa * d[1];
      const nearer = far / (far - reach * (ce * out + se * d[2]));
      wide = Math.max(wide, nearer * (Math.abs(ca * d[1] - sa * d[0]) + edge));
      high = Math.max(high, nearer * (Math.abs(ce * d[2] - se * out) + edge));
    }
    return Math.min((0.46 * box.width) / wide, (0.46 * box.height) / high);
  }

  function draw(at) {
    places = at;
    const ratio = devicePixelRatio || 1, box = canvas.getBoundingClientRect(), pen = canvas.getContext("2d");
    canvas.width = Math.round(box.width * ratio); canvas.height = Math.round(box.height * ratio);
    pen.scale(ratio, ratio);
    const ink = getComputedStyle(document.documentElement), named = (name) => ink.getPropertyValue(name).trim();
    const accent = rgb(named("--accent")), steel = rgb(named("--steel")), dark = rgb(named("--joint")), plates = rgb(named("--plate"));
    const far = 5 * reach, size = fitting(box, far) * view.zoom;
    const [ca, sa, ce, se] = [Math.cos(view.azimuth), Math.sin(view.azimuth), Math.cos(view.elevation), Math.sin(view.elevation)];
    const toEye = [ca * ce, sa * ce, se], eye = plus(middle, toEye, far);
    const project = (p) => {
      const d = plus(p, middle, -1), deep = dot(d, toEye), scale = (size / reach) * (far / (far - deep));
      return [box.width / 2 + (ca * d[1] - sa * d[0]) * scale, box.height / 2 - (ce * d[2] - se * (ca * d[0] + sa * d[1])) * scale, deep, scale];
    };
    // Shapes are drawn by order first, and from far to near within an order.
    let shapes = [];
    const shade = (colour, normal, opacity = 1) => {
      const light = 0.62 + 0.38 * dot(normal, LIGHT);
      return `rgb(${colour.map((c) => Math.round(Math.min(255, c * light))).join(" ")} / ${opacity})`;
    };
    const face = (corners, normal, colour, order = 0, opacity = 1) => {
      if (dot(normal, plus(eye, corners[0], -1)) <= 0) return;
      const seen = corners.map(project), fill = shade(colour, normal, opacity);
      shapes.push([order, seen.reduce((sum, p) => sum + p[2], 0) / seen.length, () => {
        pen.beginPath(); seen.forEach((p, k) => (k ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1]))); pen.closePath();
        pen.fillStyle = fill; pen.fill();
        if (opacity === 1) { pen.strokeStyle = fill; pen.lineWidth = 0.7; pen.stroke(); }  // no seams between faces
      }]);
    };
    // A round bar, in pieces so that crossing bars are sorted rightly; `last` is the radius at its end.
    const bar = (a, b, thick, colour, order = 0, last = thick) => {
      const way = plus(b, a, -1), long = Math.hypot(...way);
      if (!(long > 1e-6 * reach)) return;
      const u = unit(way), v = across(u), w = cross(u, v), pieces = Math.max(1, Math.min(8, Math.round(long / (6 * thick))));
      const ring = (share) => Array.from({ length: SIDES }, (_, n) => {
        const angle = (2 * Math.PI * n) / SIDES, r = thick + share * (last - thick);
        return plus(plus(plus(a, way, share), v, r * Math.cos(angle)), w, r * Math.sin(angle));
      });
      for (let piece = 0; piece < pieces; piece++) {
        const [near, next] = [ring(piece / pieces), ring((piece + 1) / pieces)];
        for (let n = 0; n < SIDES; n++) {
          const angle = (2 * Math.PI * (n + 0.5)) / SIDES, m = (n + 1) % SIDES;
          const normal = plus(v.map((value) => value * Math.cos(angle)), w, Math.sin(angle));
          face([near[n], near[m], next[m], next[n]], normal, colour, order);
        }
      }
      face(ring(1), u, colour, order); face(ring(0).reverse(), u.map((value) => -value), colour, order);
    };
    const ball = (a, r, colour, order = 0) => {
      const p = project(a), seen = Math.max(1.5, r * p[3]);
      shapes.push([order, p[2] + r, () => {
        const fill = pen.createRadialGradient(p[0] - 0.35 * seen, p[1] - 0.4 * seen, 0.1 * seen, p[0], p[1], seen);
        fill.addColorStop(0, shade(colour.map((c) => c + 0.35 * (255 - c)), LIGHT)); fill.addColorStop(1, shade(colour, LIGHT.map((c) => -0.6 * c)));
        pen.beginPath(); pen.arc(p[0], p[1], seen, 0, 7); pen.fillStyle = fill; pen.fill();
      }]);
    };
    // A plate behind joints, away from their legs; each joint stands on it. Without a plane there is none.
    const plate = (name, joints, legs, colour) => {
      const { rim, thick, away } = PLATES[name], centre = mean(joints);
      const plane = planeOf(joints, centre);
      if (!plane) return;
      const inward = mean(legs.map((leg) => unit(leg)));
      const normal = planar ? [0, 0, 1] : dot(inward, plane) < 0 ? plane.map((value) => -value) : plane;
      const v = across(normal), w = cross(normal, v);
      const flat = joints.map((p) => [dot(plus(p, centre, -1), v), dot(plus(p, centre, -1), w)]);
      const outline = hull(flat.flatMap(([x, y]) => Array.from({ length: 12 }, (_, n) => {
        const angle = (2 * Math.PI * n) / 12;
        return [x + rim * radius * Math.cos(angle), y + rim * radius * Math.sin(angle)];
      })));
      const lowest = Math.min(...joints.map((p) => dot(plus(p, centre, -1), normal)));
      const level = (height) => outline.map(([x, y]) => plus(plus(plus(centre, v, x), w, y), normal, height));
      const top = level(lowest - away * radius), bottom = level(lowest - (away + thick) * radius);
      // Seen from the legs' side a plate is behind them, otherwise before them.
      const order = dot(normal, plus(eye, top[0], -1)) > 0 ? -1 : 1;
      top.forEach((p, n) => {
        const m = (n + 1) % top.length, side = cross(plus(top[m], p, -1), normal);
        if (Math.hypot(...side) > 0) face([p, top[m], bottom[m], bottom[n]], unit(side), colour, order);
      });
      face(top, normal, colour, order); face([...bottom].reverse(), normal.map((value) => -value), colour, order, order > 0 ? 0.88 : 1);
      for (const p of joints) {
        const height = dot(plus(p, centre, -1), normal) - lowest + away * radius;
        bar(plus(p, normal, -height), p, 1.7 * radius, dark, 0.5 * order, 1.1 * radius);
      }
    };
    // A block around joints, along the axes of the platform.
    const block = (joints, axes, colour) => {
      const [low, high] = [Math.min, Math.max].map((end, k) => axes.map((axis) => end(...joints.map((p) => dot(p, axis))) + (k ? 1.7 : -1.7) * radius));
      const corner = (...ends) => axes.reduce((p, axis, k) => plus(p, axis, ends[k] ? high[k] : low[k]), [0, 0, 0]);
      axes.forEach((axis, k) => [0, 1].forEach((end) => {
        const at = (i, j) => corner(...[0, 1, 2].map((n) => (n === k ? end : n === (k + 1) % 3 ? i : j)));
        face([at(0, 0), at(1, 0), at(1, 1), at(0, 1)], axis.map((value) => (end ? value : -value)), colour);
      }));
    };

    const reached = places.subarray(0, first + 12 + 3 * drawing.points).every(Number.isFinite), marks = [];
    if (reached) {
      for (const { links, joints, rails } of drawing.legs) {
        for (const [kind, driven, home, ...pairs] of links) {
          const [[a, b], other] = pairs.map((pair) => pair.map(point)), colour = driven ? accent : steel;
          if (kind === "telescope") {
            const way = plus(b, a, -1), long = Math.hypot(...way), share = Math.min(0.56 * home, 0.88 * long) / long;
            bar(a, plus(a, way, share), 1.25 * radius, colour); bar(plus(a, way, share), b, 0.62 * radius, steel);
            bar(plus(a, way, share - 0.7 * radius / long), plus(a, way, share + 0.2 * radius / long), 1.42 * radius, dark);
          } else if (other) {  // two bars between two shafts
            for (const [near, end] of [[a, b], other]) { bar(near, end, 0.72 * radius, colour); ball(near, 1.1 * radius, dark); ball(end, 1.1 * radius, dark); }
            bar(a, other[0], 0.5 * radius, dark); bar(b, other[1], 0.5 * radius, dark);
          } else bar(a, b, (kind === "cable" ? 0.3 : 0.95) * radius, colour);
        }
        for (const k of joints) ball(point(k), 1.45 * radius, dark);
        for (const { ends: [a, b], at: k, driven } of rails) {
          const u = unit(plus(b, a, -1)), p = point(k);
          bar(a, b, 1.1 * radius, plates);
          bar(plus(p, u, -2.2 * radius), plus(p, u, 2.2 * radius), 2.1 * radius, driven ? accent : dark);
        }
      }
      const feet = drawing.legs.filter((leg) => leg.stands), heads = drawing.legs.map((leg) => point(leg.head));
      const from = (leg, k) => { const [i, j] = k === "foot" ? [leg.foot, leg.second] : [leg.head, leg.before]; return plus(point(j), point(i), -1); };
      if (drawing.base && feet.length > 2) plate("base", feet.map((leg) => point(leg.foot)), feet.map((leg) => from(leg, "foot")), plates);
      const body = accent.map((c, k) => 0.5 * (c + plates[k])), tip = tool(), axes = [3, 6, 9].map((k) => triple(first + k));
      if (drawing.block) block(heads, axes, body);
      else if (heads.length > 2) plate("platform", heads, drawing.legs.map((leg) => from(leg, "head")), body);
      const centre = mean(heads);
      if (!drawing.block && heads.length < 3) heads.forEach((p) => bar(p, tip, 0.8 * radius, plates));
      else if (Math.hypot(...plus(tip, centre, -1)) > 3 * radius) bar(centre, tip, 1.3 * radius, steel, 0, 0.4 * radius);
      ["#d1495b", "#3b8a4b", "#2f6fb0"].forEach((paint, axis) => marks.push([tip, plus(tip, axes[axis], 0.22 * reach), paint]));
    }
    shapes.sort((a, b) => a[0] - b[0] || a[1] - b[1]).forEach(([, , paint]) => paint());
    // The axes of the tool lie over all bodies, and those of the base stand in a corner.
    pen.lineCap = "round";
    for (const [a, b, paint] of marks) {
      const [p, q] = [project(a), project(b)];
      pen.strokeStyle = paint; pen.lineWidth = 2.2; pen.beginPath(); pen.moveTo(p[0], p[1]); pen.lineTo(q[0], q[1]); pen.stroke();
    }
    pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle";
    const corner = [38, box.height - 38];
    [["x", -sa, -ca * se, "#d1495b"], ["y", ca, -sa * se, "#3b8a4b"], ["z", 0, ce, "#2f6fb0"]].slice(0, planar ? 2 : 3).forEach(([name, right, up, paint]) => {
      pen.strokeStyle = pen.fillStyle = paint; pen.lineWidth = 2;
      pen.beginPath(); pen.moveTo(...corner); pen.lineTo(corner[0] + 22 * right, corner[1] - 22 * up); pen.stroke();
      pen.fillText(name, corner[0] + 30 * right, corner[1] - 30 * up);
    });
    if (!reached) {
      pen.fillStyle = named("--soft"); pen.font = "14px system-ui, sans-serif";
      pen.fillText("The machine cannot be at this pose.", box.width / 2, box.height / 2);
    }
  }

  // Unit normal of the plane that fits points best about their middle; nothing where they lie on a line.
  function planeOf(points, centre) {
    let best = null, most = 1e-3 * reach * reach;
    for (const p of points) for (const q of points) {
      const normal = cross(plus(p, centre, -1), plus(q, centre, -1)), size = Math.hypot(...normal);
      if (size > 1.001 * most) { most = size; best = normal; }
    }
    return best && unit(best);
  }
  // The convex outline of points in a plane, counter-clockwise.
  function hull(points) {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const chain = (ordered) => ordered.reduce((kept, p) => {
      const left = (a, b) => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0;
      while (kept.length > 1 && !left(kept.at(-2), kept.at(-1))) kept.pop();
      return [...kept, p];
    }, []).slice(0, -1);
    return [...chain(sorted), ...chain(sorted.reverse())];
  }
  function rgb(text) {
    const pen = document.createElement("canvas").getContext("2d");
    pen.fillStyle = text;
    return [1, 3, 5].map((k) => parseInt(pen.fillStyle.slice(k, k + 2), 16));
  }

  const redraw = () => places && draw(places);
  const raise = (angle) => { view.elevation = Math.max(-1.57, Math.min(1.57, view.elevation + angle)); };
  const zoom = (factor) => { view.zoom = Math.max(0.2, Math.min(8, view.zoom * factor)); redraw(); };
  let held = null;
  canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    view.azimuth -= 0.01 * (event.clientX - held[0]);
    raise(0.01 * (event.clientY - held[1]));
    held = [event.clientX, event.clientY]; redraw();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-0.0015 * event.deltaY)); }, { passive: false });
  canvas.addEventListener("dblclick", () => { Object.assign(view, start); redraw(); });
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (moves) { view.azimuth += moves[0]; raise(moves[1]); redraw(); }
    else if (event.key === "+" || event.key === "-") zoom(event.key === "+" ? 1.1 : 1 / 1.1);
    else if (event.key === "Home") { Object.assign(view, start); redraw(); }
    else return;
    event.preventDefault();
  });
  return { measure, draw };
}
