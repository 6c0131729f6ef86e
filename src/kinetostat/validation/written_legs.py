"""Legs of a machine written leg by leg, from its file alone: joints, links and masses where the file says they are.

Nothing of `machine.written.family` is used, so that an independent engine notices a part to which that module gives a
wrong place, stiffness or body. Points and axes are in the base frame, at the home pose.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.machine.cross_section import linear_density_of, rigidity_of
from kinetostat.machine.leg import Element, Joint, PartName, Spring
from kinetostat.machine.link import Beam, Parallelogram, matrix_springs
from kinetostat.machine.machine import Machine
from kinetostat.machine.written.joints import JOINT_TYPES
from kinetostat.units import parse
from kinetostat.validation.moving_legs import LegBody, LegPart, MovingLeg, joint_in, turn, unit, vector

Numbers = Mapping[str, Any]

FREEDOM_ORDER = {
    "cylindrical": ("rotation", "translation"),
    "universal": ("first_axis", "second_axis"),
    "spherical": ("first_axis", "second_axis", "normal"),
    "planar": ("first_axis", "second_axis", "rotation"),
}
"""Freedoms of joints that have several, from the base side on, as `actuated` names them."""
TRAVELS = dict.fromkeys(("prismatic", "cylindrical", "planar", "helical"), True) | dict.fromkeys(
    ("revolute", "universal", "spherical", "parallelogram", "fixed"), False
)
"""Whether the bearings of a joint go with the body that it moves, by type. A type that is not here is taken from its
row in `JOINT_TYPES`."""
TENSOR_PLACES = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
"""Places of the entries of a tensor in xx, yy, zz, xy, xz, yz."""


def written_legs(machine: Machine) -> list[MovingLeg]:
    """Return the legs of a machine written leg by leg, at the home pose, in the order of its file."""
    document = _document(machine)
    legs = []
    for name, parts in _by_leg(document).items():
        for title, place in _copies(name, document.get(f"legs.{name}", {})):
            joints = [_put(entry, place) for entry in parts.values() if "type" in entry]
            links = {key: _put(entry, place) for key, entry in parts.items() if "model" in entry}
            legs.append(_leg(title, joints, links, document))
    return legs


def _document(machine: Machine) -> dict[str, dict[str, Any]]:
    """Return the tables of the machine's file, SI: what it says in words, and its numbers."""
    literals, tables = machine.family.literals, machine.family_tables
    names = [name for name in dict.fromkeys([*literals, *tables]) if name.startswith(("legs.", "sections."))]
    return {name: {**literals.get(name, {}), **(vars(tables[name]) if name in tables else {})} for name in names}


def _by_leg(document: Mapping[str, Numbers]) -> dict[str, dict[str, dict[str, Any]]]:
    """Joints and links of each leg as they are written, by name; a series of parts is the `stiffness` of its joint."""
    legs: dict[str, dict[str, dict[str, Any]]] = {}
    for path, entry in document.items():
        kind, leg, *names = path.split(".")
        if kind == "legs" and len(names) == 1:
            legs.setdefault(leg, {})[names[0]] = {**entry, "name": names[0]}
    for path, entry in document.items():
        kind, leg, *names = path.split(".")
        if kind == "legs" and len(names) == 2:
            legs[leg][names[0]]["stiffness"] = dict(entry)
    return legs


def _copies(name: str, entry: Numbers) -> Iterator[tuple[str, Array]]:
    """Give the names of the legs that a written leg stands for, and what turns (and mirrors) it into each [3 x 3]."""
    if "copies" not in entry:
        yield name, np.eye(3)
        return
    images = [np.eye(3), np.diag([1.0, -1.0, 1.0])] if entry["mirrored"] else [np.eye(3)]
    turns = entry["copies"] // len(images)
    angles = [parse(angle, "angle") for angle in entry.get("angles", ())]
    angles = angles or [2.0 * math.pi * i / turns for i in range(turns)]
    places = [turn(np.array([0.0, 0.0, 1.0]), angle) @ image for angle in angles for image in images]
    yield from ((f"{name} {i}", place) for i, place in enumerate(places, 1))


def _put(entry: Numbers, place: Array) -> dict[str, Any]:
    """Joint or link with its points, directions and matrices where a copy has them; a mirror turns the other way."""
    placed = dict(entry)
    for key, value in entry.items():
        if key == "inertia":
            placed[key] = place @ np.asarray(value)[np.array(TENSOR_PLACES)] @ place.T
        elif key == "compliance":
            both = np.kron(np.diag([np.linalg.det(place), 1.0]), place)
            placed[key] = both @ np.asarray(value) @ both.T
        elif isinstance(value, tuple | list) and len(value) == 3 and key != "joins":
            placed[key] = place @ np.asarray(value, dtype=float)
    return placed


def _leg(name: str, joints: Sequence[Numbers], links: Mapping[str, Numbers], document: Numbers) -> MovingLeg:
    parts: list[LegPart] = []
    bodies: list[LegBody] = []
    for i, joint in enumerate(joints):
        parts += _joint(name, joint, document)
        if i + 1 == len(joints):
            break
        following, body = joints[i + 1], joint["joins"][1]
        link, ends = links.get(body, {}), (np.asarray(joint.get("far", joint["point"])), np.asarray(following["point"]))
        flexible = _link(PartName(name, body), link, ends, document)
        if any(other["type"] != "fixed" for other in joints[: i + 1]):
            struts = [other["section"] for other in joints if body in other["joins"] and "section" in other]
            section = next(iter([link["section"]] if "section" in link else struts), "")
            counts = len(parts), len(parts) + len(flexible)
            bodies.append(_body(f"{name} {body}", link, ends, counts, document.get(f"sections.{section}")))
        parts += flexible
    return MovingLeg(name, tuple(parts), tuple(bodies))


def _joint(leg: str, joint: Numbers, document: Numbers) -> list[LegPart]:
    """Return the parts of a joint: its freedoms, of which one may have springs in a row and a rod, and its bearings."""
    name, kind = PartName(leg, joint["name"]), joint["type"]
    moving = [LegPart(element, moves=True) for element in _elements(name, joint)]
    if "stiffness" in joint:
        actuated = joint.get("actuated", False)
        order = FREEDOM_ORDER.get(kind, tuple(JOINT_TYPES[kind].motors))
        at = 0 if isinstance(actuated, bool) else order.index(actuated)
        freedom = joint_in(moving[at].element)
        row = _row(name, freedom, joint, bool(actuated))
        rod = _axial(joint, document)
        if rod is not None:
            begin = replace(freedom, carriage=vector(joint["point"]))
            row.append(LegPart(Spring(PartName(leg, f"{joint['name']} rod"), begin, rod), rod=True))
        moving[at : at + 1] = row
    bearings = [LegPart(spring) for spring in _bearings(name, joint)]
    travels = TRAVELS[kind] if kind in TRAVELS else JOINT_TYPES[kind].bearings_travel
    return [*moving, *bearings] if travels and "compliance" not in joint else [*bearings, *moving]


def _elements(name: PartName, joint: Numbers) -> Sequence[Element]:
    """Return the elements of a joint that move, from the base side to the platform side."""
    kind = joint["type"]
    if kind == "parallelogram":
        ends = vector(joint["point"]), vector(joint["far"])
        return [Parallelogram(name, *ends, vector(unit(joint["axis"])), joint["width"], joint["bar_stiffness"])]
    if kind in TRAVELS:
        return [replace(freedom, name=name) for freedom in _freedoms(joint)]
    motor = JOINT_TYPES[kind].motors.get(joint.get("actuated", ""))
    make = motor.elements if motor and motor.elements else JOINT_TYPES[kind].elements
    return make(name, SimpleNamespace(**joint))


def _freedoms(joint: Numbers) -> list[Joint]:
    """Return the freedoms of a joint of a known type, from the base side to the platform side."""
    kind, point = joint["type"], vector(joint["point"])
    if kind == "fixed":
        return []
    if "first_axis" not in joint:
        axes = np.eye(3) if kind == "spherical" else [unit(joint["axis"])]
    else:
        both = unit(joint["first_axis"]), unit(joint["second_axis"])
        axes = [*both, unit(np.cross(*both))]
    slides = {"prismatic": (0,), "planar": (0, 1)}.get(kind, ())
    count = {"universal": 2, "planar": 3, "spherical": 3}.get(kind, 1)
    directions = [vector(axis) for axis in axes[:count]]
    pitch = joint.get("pitch", 0.0)
    freedoms = [Joint(way) if i in slides else Joint(way, point, pitch=pitch) for i, way in enumerate(directions)]
    return [*freedoms, Joint(directions[0])] if kind == "cylindrical" else freedoms


def _row(name: PartName, freedom: Joint, joint: Numbers, actuated: bool) -> list[LegPart]:
    """Return the springs on a freedom, one or several in a row, of which the first one moves."""
    given = joint["stiffness"]
    stiffnesses = list(given.values()) if isinstance(given, dict) else [given]
    first = Spring(name, freedom, stiffnesses[0], name, actuated, not actuated, acts=joint.get("acts", ""))
    others = [Spring(name, freedom, stiffness, name, acts=joint.get("acts", "")) for stiffness in stiffnesses[1:]]
    return [LegPart(first, moves=True), *map(LegPart, others)]


def _axial(joint: Numbers, document: Numbers) -> float | None:
    """E A of the rod of a strut, N; None if the joint has none."""
    if "section" in joint:
        return float(_rigidity(document[f"sections.{joint['section']}"]).axial)
    return joint.get("axial_rigidity")


def _rigidity(section: Numbers, shear: bool = False) -> Any:
    return rigidity_of(section["shape"], SimpleNamespace(**section), shear)


def _bearings(name: str, joint: Numbers) -> Sequence[Spring]:
    """Return the springs of the bearings of a joint, from a matrix or in the directions of its axis."""
    point = vector(joint["point"])
    if "compliance" in joint:
        return matrix_springs(name, joint["compliance"], point)
    stiffnesses = {key.removeprefix("stiffness_"): joint[key] for key in joint if key.startswith("stiffness_")}
    if not stiffnesses:
        return ()
    axis = unit(joint["axis"] if "axis" in joint else np.cross(unit(joint["first_axis"]), unit(joint["second_axis"])))
    along, *across = (vector(row) for row in _around(axis))
    rows = {
        "axial": [Joint(along)],
        "radial": [Joint(way) for way in across],
        "torsion": [Joint(along, point)],
        "tilt": [Joint(way, point) for way in across],
    }
    return [Spring(f"{name} {way}", freedom, k) for way, k in stiffnesses.items() for freedom in rows[way]]


def _link(name: PartName, link: Numbers, ends: tuple[Array, Array], document: Numbers) -> list[LegPart]:
    """Return the parts that stand for a link that deflects."""
    model = link.get("model", "rigid")
    if model == "rigid":
        return []
    if model == "matrix":
        return [LegPart(spring) for spring in matrix_springs(name, link["compliance"], vector(ends[1]))]
    span = ends[1] - ends[0]
    up = np.asarray(link.get("up", np.eye(3)[np.argmin(np.abs(span))]), dtype=float)
    rigidity = _rigidity(document[f"sections.{link['section']}"], model == "timoshenko")
    if model != "lumped":
        return [LegPart(Beam(name, vector(ends[0]), vector(ends[1]), vector(up), rigidity))]
    length, along, start = float(np.linalg.norm(span)), unit(span), vector(ends[0])
    y = unit(np.cross(up, along))
    turning = ((along, rigidity.torsion), (y, 3.0 * rigidity.bending_y), (np.cross(along, y), 3.0 * rigidity.bending_z))
    springs = [Spring(name, Joint(vector(axis), start), k / length) for axis, k in turning]
    return [*map(LegPart, springs), LegPart(Spring(name, Joint(vector(along)), rigidity.axial / length))]


def _body(
    name: str, link: Numbers, ends: tuple[Array, Array], counts: tuple[int, int], section: Numbers | None
) -> LegBody:
    """A link with its mass: what the file gives for it, otherwise what its cross-section weighs over its length."""
    if "mass" in link:
        return LegBody(name, link["mass"], ends, counts, link.get("centre_of_mass"), link.get("inertia"))
    density = linear_density_of(section["shape"], SimpleNamespace(**section)) if section else 0.0
    return LegBody(name, float(density) * float(np.linalg.norm(ends[1] - ends[0])), ends, counts)


def _around(axis: Array) -> Array:
    """Return three unit vectors as rows: an axis and two across it."""
    y = unit(np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis))
    return np.array([axis, y, np.cross(axis, y)])
