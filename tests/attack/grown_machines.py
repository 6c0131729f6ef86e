"""Machines that close, with any joints, drives and links: the grammar of whole machine files, in plain SI numbers.

A machine is drawn by the motion of its platform: legs that allow it (`grown_legs`), drives until something resists
every motion, links, bearings and loads at random, and a pose near the home pose, of coordinates that are independent
there. What cannot be held is drawn again, so that nearly all of these machines have an answer.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import grown_legs as legs
import numpy as np
from grown_legs import Drawn, Joint, Leg, Place

from kinetostat.arrays import Array
from kinetostat.machine.written.joints import JOINT_TYPES, needs_axis, stiffness_kind

Document = dict[str, Any]

REGULAR = 0.02
"""Least singular value of twists of a leg, and of the wrenches that hold the platform: draws below it are too singular
to say anything about the digits of an answer."""
SPATIAL = ("x", "y", "z", "roll", "pitch", "yaw")
PLANAR = ("x", "y", "yaw")
MODELS = ("rigid", "lumped", "beam", "timoshenko", "matrix")
WEIGHTS = {"mixed": (3, 2, 2, 2, 2), "ideal": (1, 0, 0, 0, 0), "elastic": (0, 1, 1, 1, 1)}
"""How often a link of a machine has each model."""


@dataclass(frozen=True)
class Drive:
    """One freedom of one joint: of which leg, which joint, and which of its motors, which is empty if it has one."""

    leg: int
    joint: int
    motor: str
    column: int


def machine(rng: Random) -> Document:
    """A machine file that has an answer, nearly always."""
    if rng.random() < 0.05:
        return cables(rng)
    while True:
        planar = rng.random() < 0.08
        chains, motion = _planar_legs(rng) if planar else _legs(rng)
        placed = _driven(rng, chains, motion[1])
        if placed is not None:
            return _document(rng, chains, placed, motion, planar)


Motion = tuple[Array, Array]
"""The twists of the platform about P at the home pose, about the base's origin [6 x freedoms]; and P, m."""


def _places(rng: Random, count: int, centre: Array, planar: bool = False) -> list[tuple[Array, Array]]:
    """Feet about the base's origin and heads about a centre."""
    start, places = rng.uniform(0.0, 2.0 * math.pi), []
    for i in range(count):
        angle = start + 2.0 * math.pi * i / count + rng.uniform(-0.25, 0.25)
        around = np.array([math.cos(angle), math.sin(angle), 0.0])
        up = np.array([0.0, 0.0, 0.0 if planar else 1.0])
        foot = rng.uniform(0.25, 0.5) * around + rng.uniform(-0.05, 0.05) * up
        places.append((foot, centre + rng.uniform(0.06, 0.2) * around + rng.uniform(-0.05, 0.05) * up))
    return places


def _legs(rng: Random) -> tuple[list[Leg], Motion]:
    """Legs of a spatial machine, and how its platform can move; those that depend on each other are drawn again."""
    centre = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), rng.uniform(0.2, 0.5)])
    axis, shared = legs.direction(rng), legs.direction(rng)
    count = rng.choice((2, 3, 3, 4))
    kinds: dict[str, list[Drawn]] = {
        "any": [legs.free_leg(6)] * rng.choice((2, 3, 4, 6)),
        "guided": [legs.free_leg(rng.randint(1, 5)), *[legs.free_leg(6)] * rng.choice((1, 2, 3, 4))],
        "constrained": [
            legs.free_leg(n) for n in rng.choice(((5, 5), (5, 5, 5), (4, 5), (4, 4), (5, 5, 5, 5), (3, 5)))
        ],
        "translating": [rng.choice((legs.about_one_axis, legs.with_cardans)) for _ in range(count)],
        "turning with slides": [legs.about_one_axis] * count,
        "turning": [legs.about_centre] * count,
        "across": [legs.in_plane] * count,
        "along": [legs.along_one_axis, *[legs.about_one_axis] * (count - 2), legs.free_leg(6)],
    }
    name = rng.choice([*kinds])
    drawn = list(kinds[name])
    if name in ("translating", "turning", "across", "turning with slides") and rng.random() < 0.3:
        drawn[-1] = legs.free_leg(6)
    chains = []
    for draw, (foot, head) in zip(drawn, _places(rng, len(drawn), centre), strict=True):
        own = legs.direction(rng) if name == "translating" else axis if rng.random() < 0.5 else shared
        chains.append(draw(rng, Place(foot, head, own if name == "translating" else axis, centre)))
    rng.shuffle(chains)
    turns = name in ("turning", "along") or rng.random() < 0.4
    point = centre if turns else centre + 0.05 * legs.direction(rng)
    return chains, (_motion(chains, point, []), point)


def _planar_legs(rng: Random) -> tuple[list[Leg], Motion]:
    point = np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.0])
    freedoms = rng.choice(((3, 3), (3, 3, 3), (2, 3), (3, 3, 3, 3), (2, 3, 3)))
    places = _places(rng, len(freedoms), point, planar=True)
    chains = [
        legs.planar_leg(n)(rng, Place(*ends, np.zeros(3), point)) for n, ends in zip(freedoms, places, strict=True)
    ]
    return chains, (_motion(chains, point, _absent()), point)


def _absent() -> list[Array]:
    """The twists that a machine in the x-y plane has not: to them it is rigid."""
    return [legs.turn(np.eye(3)[0], np.zeros(3)), legs.turn(np.eye(3)[1], np.zeros(3)), legs.slide(np.eye(3)[2])]


def _motion(chains: Sequence[Leg], about: Array, absent: list[Array]) -> Array:
    """Twists about P that all legs allow, angles in units of the machine's length, orthonormal [6 x freedoms]."""
    wrenches = [legs.held_by(np.hstack([joint.twists for joint in leg]), about) for leg in chains]
    guides = [legs.weighed(np.array(absent).T, about)] if absent else []
    held = np.hstack([*wrenches, *guides])
    left, sizes, _ = np.linalg.svd(held, full_matrices=True)
    return left[:, np.sum(sizes > 1e-9) :]


def _driven(rng: Random, chains: list[Leg], about: Array) -> list[Drive] | None:
    """Motors that hold the platform, drawn one by one; None where legs or motors are too near to a singular pose."""
    planar = all(joint.fields["point"][2] == 0.0 for leg in chains for joint in leg)
    joined = [np.hstack([joint.twists for joint in leg]) for leg in chains]
    if any(legs.least_share(twists, about) < REGULAR and _kinds(leg) not in legs.IDLE
           for leg, twists in zip(chains, joined, strict=True)):  # fmt: skip
        return None
    possible = [
        Drive(i, k, motor, column)
        for i, leg in enumerate(chains)
        for k, joint in enumerate(leg)
        for motor, column in motors(joint.kind)
    ]
    rng.shuffle(possible)
    drives: list[Drive] = []
    held = _strengths(joined, chains, drives, about, planar)
    for drive in possible:
        if any((d.leg, d.joint) == (drive.leg, drive.joint) for d in drives):
            continue
        further = _strengths(joined, chains, [*drives, drive], about, planar)
        if np.sum(further > REGULAR) > np.sum(held > REGULAR) or rng.random() < 0.03:
            drives, held = [*drives, drive], further
    return drives if drives and np.sum(held > REGULAR) == 6 else None


def _kinds(leg: Leg) -> tuple[str, ...]:
    return tuple(joint.kind for joint in leg)


def motors(kind: str) -> list[tuple[str, int]]:
    """Freedoms of a type of joint that may be driven: what `actuated` says, and the place of the freedom."""
    row = JOINT_TYPES[kind]
    return [("", 0)] if row.stiffness else [(name, motor.place) for name, motor in row.motors.items()]


def _strengths(joined: list[Array], chains: list[Leg], drives: list[Drive], about: Array, planar: bool) -> Array:
    """Singular values of all wrenches that the legs hold with these drives locked."""
    held = [legs.weighed(np.array(_absent()).T, about)] if planar else []
    for i, (twists, leg) in enumerate(zip(joined, chains, strict=True)):
        first = np.cumsum([0, *(joint.twists.shape[1] for joint in leg)])
        locked = [first[d.joint] + d.column for d in drives if d.leg == i]
        held.append(legs.held_by(np.delete(twists, locked, axis=1), about))
    return np.linalg.svd(np.hstack(held), compute_uv=False)


def _document(rng: Random, chains: list[Leg], drives: list[Drive], motion: Motion, planar: bool) -> Document:
    twists, point = motion
    how = rng.choice(("mixed", "mixed", "mixed", "ideal", "elastic"))
    sections = {f"s{i}": section(rng) for i in range(rng.randint(1, 3))}
    written = []
    for i, leg in enumerate(chains):
        own = {drive.joint: drive.motor for drive in drives if drive.leg == i}
        written.append(_leg(rng, f"leg{i}", leg, own, how, sections, planar))
    head = {"schema": 1, "name": f"grown {how}", "family": "legs", "space": "planar" if planar else "spatial"}
    document = {**head, "platform": {"point": point.tolist()}, "pose": _pose(rng, twists, point, planar)}
    return {**document, "sections": sections, "legs": written, **_tool_and_load(rng, planar)}


def _pose(rng: Random, twists: Array, point: Array, planar: bool) -> dict[str, float]:
    """As many coordinates as the platform has freedoms, those that its motion changes most, at or near home."""
    names = PLANAR if planar else SPATIAL
    home = dict(zip(SPATIAL, [*point.tolist(), 0.0, 0.0, 0.0], strict=True))
    rows = dict(zip(("roll", "pitch", "yaw", "x", "y", "z"), twists.copy(), strict=True))
    chosen: list[str] = []
    while len(chosen) < twists.shape[1]:
        name = max((n for n in names if n not in chosen), key=lambda n: np.linalg.norm(rows[n]))
        chosen.append(name)
        along = legs.unit(rows[name])
        rows = {n: row - along * (row @ along) for n, row in rows.items()}
    far = 0.0 if rng.random() < 0.25 else rng.choice((0.005, 0.015, 0.04))
    sizes = {name: far * (legs.LENGTH if name in "xyz" else 1.0) for name in chosen}
    return {name: home[name] + sizes[name] * rng.uniform(-1.0, 1.0) for name in names if name in chosen}


def _leg(
    rng: Random, name: str, leg: Leg, motors: dict[int, str], how: str, sections: Document, planar: bool
) -> Document:
    """A leg with its drives, its bearings and its links; some are clamped to the base or to the platform."""
    joints = [dict(_joint(rng, joint, motors.get(k), how)) for k, joint in enumerate(leg)]
    ends = [joint.end.tolist() for joint in leg]
    if rng.random() < 0.25:
        joints.insert(0, _clamp(rng, joints[0]["point"], planar, how))
        ends.insert(0, joints[0]["point"])
    if rng.random() < 0.35:
        joints.append(_clamp(rng, ends[-1], planar, how))
        ends.append(joints[-1]["point"])
    bodies = ["base", *(f"b{k}" for k in range(1, len(joints))), "platform"]
    made = [
        {"name": f"j{k}", "joins": bodies[k : k + 2], **{n: _plain(v) for n, v in joint.items()}}
        for k, joint in enumerate(joints)
    ]
    links = {}
    for k in range(len(joints) - 1):
        link = _link(rng, np.array(joints[k + 1]["point"]) - np.array(ends[k]), ends[k], how, sections)
        if link is not None:
            links[bodies[k + 1]] = link
    return {"name": name, "joints": made, "links": links}


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _clamp(rng: Random, near: list[float], planar: bool, how: str) -> Document:
    beside = np.array([1.0, 1.0, 0.0 if planar else 1.0]) * 0.12 * legs.direction(rng)
    fixed = {"type": "fixed", "point": (np.array(near) + beside).tolist()}
    return fixed | ({} if how == "ideal" else bearings(rng, "fixed", fixed))


def size(rng: Random, low: float, high: float, spread: bool = False) -> float:
    """A number between powers of ten, four digits; of great contrast where it is `spread`."""
    return float(f"{10.0 ** rng.uniform(low - 2.0 * spread, high + 2.0 * spread):.4g}")


def spring(rng: Random, kind: str) -> Any:
    """A stiffness: one number, rigid, or parts in a row."""
    low, high = (6.0, 8.5) if kind == "linear stiffness" else (3.0, 5.5)
    choice = rng.random()
    if choice < 0.12:
        return "rigid"
    if choice < 0.24:
        return {"screw": size(rng, low, high), "nut": size(rng, low, high)}
    return size(rng, low, high, spread=choice > 0.85)


def _joint(rng: Random, joint: Joint, motor: str | None, how: str) -> Document:
    kind, written = joint.kind, {"type": joint.kind, **joint.fields}
    if motor is not None:
        written |= {"actuated": motor or True, "stiffness": spring(rng, stiffness_kind(kind, motor))}
        if kind == "spherical":
            first = legs.direction(rng)
            written |= {"first_axis": first, "second_axis": legs.direction(rng, apart=first)}
        if rng.random() < 0.1:
            written["preload"] = rng.uniform(-50.0, 50.0)
    elif JOINT_TYPES[kind].stiffness and rng.random() < 0.06:
        written["stiffness"] = size(rng, *((4.0, 6.0) if kind == "prismatic" else (1.0, 3.0)))
    return written if how == "ideal" else written | bearings(rng, kind, written)


def bearings(rng: Random, kind: str, written: Document) -> Document:
    """What the bearings of a joint resist: mostly rigid, otherwise in its own axes or as a matrix."""
    choice, ways = rng.random(), JOINT_TYPES[kind].seat
    if choice < 0.1:
        return {"compliance": compliance(rng, 0.0)}
    if choice > 0.3 or not ways:
        return {}
    drawn = rng.sample(ways, rng.randint(1, len(ways)))
    limits = {way: (7.0, 9.0) if way in ("radial", "axial") else (4.0, 6.0) for way in drawn}
    seat: Document = {f"stiffness_{way}": size(rng, *limits[way]) for way in drawn}
    return seat | ({"axis": legs.direction(rng)} if needs_axis(kind) and "axis" not in written else {})


def compliance(rng: Random, reach: float) -> list[Any]:
    """A 6x6 without negative eigenvalue, of full rank or less; or six numbers."""
    scale = np.array([3e-6] * 3 + [3e-8 + 1e-6 * reach] * 3)
    if rng.random() < 0.3:
        return [float(c * 10.0 ** rng.uniform(-1.0, 1.0)) if rng.random() < 0.7 else 0.0 for c in scale]
    factors = np.array([[rng.gauss(0.0, 1.0) for _ in range(rng.choice((6, 6, 6, 3)))] for _ in range(1)])
    rows = [[rng.gauss(0.0, 1.0) for _ in range(factors.shape[1])] for _ in range(6)]
    matrix = np.array(rows) @ np.array(rows).T / factors.shape[1]
    scaled = np.sqrt(np.outer(scale, scale)) * matrix
    return ((scaled + scaled.T) / 2.0).tolist()


def section(rng: Random) -> Document:
    """A cross-section of any shape, of a material or with moduli of its own."""
    shapes: dict[str, Document] = {
        "round": {"diameter": size(rng, -1.9, -1.3)},
        "tube": {"outer_diameter": 0.04, "inner_diameter": rng.uniform(0.0, 0.038)},
        "rectangle": {"width": size(rng, -1.9, -1.3), "height": size(rng, -1.9, -1.3)},
        "own": {"area": size(rng, -3.5, -2.5), "second_moment_y": size(rng, -8.0, -6.0),
                "second_moment_z": size(rng, -8.0, -6.0), "torsion_constant": size(rng, -8.0, -6.0)},
    }  # fmt: skip
    shape = rng.choice([*shapes])
    moduli = {"youngs_modulus": size(rng, 10.0, 11.5), "shear_modulus": size(rng, 9.5, 11.0)}
    made = moduli if rng.random() < 0.3 else {"material": rng.choice(("steel", "aluminium", "cast-iron", "cfrp"))}
    return {"shape": shape, **shapes[shape], **made}


def _link(rng: Random, span: Array, start: list[float], how: str, sections: Document) -> Document | None:
    """A link along a span; None where the file says nothing of it. One without length is rigid."""
    (model,) = rng.choices(MODELS, WEIGHTS[how])
    if np.linalg.norm(span) < 1e-3:
        return None
    written: Document = {"model": model}
    if model not in ("rigid", "matrix") or rng.random() < 0.3:
        written["section"] = rng.choice([*sections])
        if model not in ("rigid", "matrix"):
            written["up"] = legs.direction(rng, apart=span).tolist()
    if model == "matrix":
        written["compliance"] = compliance(rng, float(np.linalg.norm(span)))
    if rng.random() < 0.15:
        written["mass"] = size(rng, -1.0, 1.0)
        if rng.random() < 0.5:
            written["centre_of_mass"] = (np.array(start) + rng.uniform(0.0, 1.0) * span).tolist()
            if rng.random() < 0.5:
                written["inertia"] = [0.01, 0.02, 0.02, 0.001, 0.0, -0.002]
    return written


def _tool_and_load(rng: Random, planar: bool) -> Document:
    flat = 0.0 if planar else 1.0
    made: Document = {}
    if rng.random() < 0.6:
        made["tool"] = {"offset": [rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), flat * rng.uniform(-0.1, 0.1)]}
    if rng.random() < 0.4:
        made.setdefault("tool", {}).update(
            mass=size(rng, -0.5, 1.0),
            centre_of_mass=[0.02, -0.01, 0.03 * flat],
            inertia=[0.02, 0.02, 0.03, 0, 0, 0.001],
        )
    if rng.random() < 0.6:
        down = [0.0, -9.81, 0.0] if planar else [0.0, 0.0, -9.81]
        made["load"] = {
            "force": [rng.uniform(-50.0, 50.0), rng.uniform(-50.0, 50.0), flat * rng.uniform(-50.0, 50.0)],
            "moment": [flat * rng.uniform(-3.0, 3.0), flat * rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0)],
            **({"gravity": down} if "mass" in made.get("tool", {}) else {}),
        }
    return made


def cables(rng: Random) -> Document:
    """A platform on cables, from above and below, with a weight."""
    point = np.array([0.0, 0.0, 1.2])
    count = rng.choice((6, 7, 8, 9))
    preload = rng.choice((0.0, 100.0, None))
    written = []
    for i in range(count):
        angle = 2.0 * math.pi * i / count + rng.uniform(-0.3, 0.3)
        around = np.array([math.cos(angle), math.sin(angle), 0.0])
        away = angle + rng.uniform(-1.5, 1.5)
        ends = 2.0 * around, 0.3 * np.array([math.cos(away), math.sin(away), 0.0])
        heights = (rng.uniform(2.0, 2.5), -0.1) if i % 2 else (rng.uniform(-0.2, 0.2), 0.1)
        pulled = rng.uniform(20.0, 300.0) if preload is None else preload
        start, end = ends[0] + [0.0, 0.0, heights[0]], point + ends[1] + [0.0, 0.0, heights[1]]
        cable = {"from": start.tolist(), "to": end.tolist(), "stiffness": size(rng, 5.0, 6.0), "preload": pulled}
        written.append({"name": f"cable{i}", "type": "cable", **cable})
    pose = {
        name: value + 0.05 * rng.uniform(-1.0, 1.0)
        for name, value in zip(SPATIAL, [*point.tolist(), 0, 0, 0], strict=True)
    }
    places = {name: [rng.uniform(-0.1, 0.1) for _ in range(3)] for name in ("offset", "centre_of_mass")}
    tool = {**places, "mass": rng.uniform(1.0, 30.0)}
    load = {"gravity": [0.0, 0.0, -9.81], "force": [rng.uniform(-20.0, 20.0) for _ in range(3)]}
    head = {"schema": 1, "name": "grown cables", "family": "legs", "platform": {"point": point.tolist()}}
    return {**head, "pose": pose, "legs": written, "tool": tool, "load": load}


def parts_of(document: Document) -> Counter[str]:
    """Types of joints, motors and link models of a machine, each once: what an answered machine has shown."""
    found: set[str] = set()
    for leg in document["legs"]:
        if "type" in leg:
            found.add("joint cable")
            continue
        for joint in leg["joints"]:
            found.add(f"joint {joint['type']}")
            if joint.get("actuated"):
                motor = joint["actuated"]
                found.add(f"motor {joint['type']}" + ("" if motor is True else f" {motor}"))
            found.update(f"bearing {key}" for key in joint if key.startswith("stiffness_"))
        found.update(f"link {link['model']}" for link in leg["links"].values())
    return Counter(found)


def parts() -> list[str]:
    """Every link model that there is, and every type of joint that drawn machines have, with every motor of it."""
    drives = [f"motor {kind}" + (f" {name}" if name else "") for kind in legs.FREEDOMS for name, _ in motors(kind)]
    return [*(f"joint {kind}" for kind in legs.FREEDOMS), *drives, *(f"link {model}" for model in MODELS)]
