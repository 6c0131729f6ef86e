"""A machine at its pose as its file describes it, for independent engines: joints, links and masses where it says.

The joints, links and masses of a machine that is written leg by leg are read once more, and its legs are closed by
`moving_legs`; joint coordinates that kinetostat has found only say where to begin, which decides the assembly mode.
Nothing of `machine.written.family` is used, so that an engine notices a part to which that module gives a wrong place,
stiffness or body. Actuated struts and cranks of families are placed once more, from the radii, angles, lengths and
springs of the file and the pose, so that an engine notices joints that a family's closed form puts elsewhere. Passive
legs, and legs with pairs of bars, are those of the family. Points and axes are in the base frame, SI.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from kinetostat.algebra.vector import AXES, Displacement, Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.cross_section import linear_density_of, rigidity_of
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring, Turn
from kinetostat.machine.link import Beam, Parallelogram, Rigidity, matrix_springs
from kinetostat.machine.loads import located_members
from kinetostat.machine.machine import Configuration, Machine, Member, Plane
from kinetostat.machine.parts import Arm
from kinetostat.machine.written.joints import JOINT_TYPES
from kinetostat.units import parse
from kinetostat.validation.moving_legs import (
    LegBody,
    LegPart,
    MovingLeg,
    apply,
    joint_in,
    placement,
    turn,
    unit,
    vector,
)
from kinetostat.validation.pieces import array, columns, matrix_of

Entry = Mapping[str, Any]
"""A joint, a link or a table of the file, by field, in SI."""

FREEDOM_ORDER = {
    "cylindrical": ("rotation", "translation"),
    "universal": ("first_axis", "second_axis"),
    "spherical": ("first_axis", "second_axis", "normal"),
    "planar": ("first_axis", "second_axis", "rotation"),
}
"""Freedoms of joints that have several, from the base side on, as `actuated` names them."""
BEARINGS_TRAVEL = dict.fromkeys(("prismatic", "cylindrical", "planar", "helical"), True) | dict.fromkeys(
    ("revolute", "universal", "spherical", "parallelogram", "fixed"), False
)
"""Whether the bearings of a joint go with the body that it moves, by the types that are written a second time here. Any
other type is taken from its row in `JOINT_TYPES`."""
X, Y, Z = np.eye(3)  # unit vectors along the axes of the base frame
BENDING_OF_TIP = 3.0
"""Stiffness k of a cantilever against turning of its chord under a force on its tip: k = 3 E I / length."""
CRANKS_SUFFIX = "-rus"
"""End of the names of families whose legs have cranks in the place of struts."""


def _tilt(pose: Any) -> Array:
    return turn(Y, pose.theta1) @ turn(X, pose.theta2)


PLATFORMS: Mapping[str, Callable[[Any], Array]] = {
    "hexapod": lambda pose: placement(_roll_pitch_yaw(vars(pose)), np.array([pose.x, pose.y, pose.z])),
    "passive-leg-3dof-pu": lambda pose: placement(_tilt(pose), pose.z * Z),
    "tricept": lambda pose: placement(_tilt(pose), _tilt(pose) @ (pose.length * Z)),
    "planar-3rpr": lambda pose: placement(turn(Z, pose.angle), np.array([pose.x, pose.y, 0.0])),
}
"""Placement of the platform at a pose, by family [4 x 4]."""
GUIDED = ("passive-leg-4dof", "passive-leg-5dof")
"""Families whose platform is where their passive leg takes it."""


@dataclass(frozen=True)
class MachineFromFile:
    """A machine at its pose as its file describes it.

    Attributes:
        configuration: the platform and every leg.
        reference: the tool point T, base frame, m.
        members: the links with their masses.
    """

    configuration: Configuration
    reference: Vector
    members: tuple[Member, ...]


def machine_from_file(machine: Machine, response: Response, joints: Joints | None) -> MachineFromFile:
    """Return a machine as its file describes it.

    Args:
        machine: the machine at its pose.
        response: the response of the machine; where the file leaves coordinates of the pose open, it says them.
        joints: joint coordinates of a machine written leg by leg at the pose; None for families.

    Raises:
        InputError: if a leg as the file describes it does not reach the platform.
    """
    if joints is None:
        configuration = with_legs_of_file(machine, response.configuration)
        tool_point = configuration.platform.apply(Vector(*machine.tables["tool"].offset))
        return MachineFromFile(configuration, tool_point, tuple(located_members(machine, configuration, None)))
    ours = response.configuration
    platform, length = _platform(machine, ours.platform), float(ours.length)
    home = placement(np.eye(3), np.array(machine.tables["platform"].point, dtype=float))
    remaining, legs, members = [_coordinate(amount) for amount in joints.coordinates], [], []
    for leg in written_legs(machine):
        start, remaining = remaining[: leg.size], remaining[leg.size :]
        placements = leg.closed_placements(start, platform @ np.linalg.inv(home), length)
        legs.append(leg.at_pose(placements))
        members += [body.member(leg.name, placements) for body in leg.bodies]
    plane = Plane() if machine.family.planar else None
    tool_point = vector(apply(platform, np.array(machine.tables["tool"].offset, dtype=float)))
    configuration = Configuration(_displacement(platform), tuple(legs), (), length, plane)
    return MachineFromFile(configuration, tool_point, tuple(members))


def _displacement(place: Array) -> Displacement:
    return Displacement(Rotation(*(vector(axis) for axis in place[:3, :3].T)), vector(place[:3, 3]))


def _platform(machine: Machine, ours: Displacement) -> Array:
    """Return the placement of the platform [4 x 4], of coordinates that the file gives and our values of the others."""
    rotation, place = columns(ours.rotation), array(ours.translation)
    pose: Mapping[str, float] = {
        "x": place[0],
        "y": place[1],
        "z": place[2],
        "roll": math.atan2(rotation[2, 1], rotation[2, 2]),
        "pitch": math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0])),
        "yaw": math.atan2(rotation[1, 0], rotation[0, 0]),
        **vars(machine.tables["pose"]),
    }
    return placement(_roll_pitch_yaw(pose), np.array([pose["x"], pose["y"], pose["z"]]))


def _roll_pitch_yaw(pose: Mapping[str, float]) -> Array:
    """Return the rotation Rz(yaw) Ry(pitch) Rx(roll) [3 x 3]."""
    return turn(Z, pose["yaw"]) @ turn(Y, pose["pitch"]) @ turn(X, pose["roll"])


def _coordinate(amount: object) -> float:
    """Return a joint coordinate as a number, rad or m."""
    return math.atan2(float(amount.sine), float(amount.cosine)) if isinstance(amount, Turn) else float(amount)  # type: ignore[arg-type]


def written_legs(machine: Machine) -> list[MovingLeg]:
    """Return the legs of a machine written leg by leg, at the home pose, in the order of its file."""
    document = _document(machine)
    legs = []
    for name, parts in _by_leg(document).items():
        for title, place in _copies(name, document.get(f"legs.{name}", {})):
            joints = [_entry_of_copy(entry, place) for entry in parts.values() if "type" in entry]
            links = {key: _entry_of_copy(entry, place) for key, entry in parts.items() if "model" in entry}
            legs.append(_moving_leg(title, joints, links, document))
    return legs


def _document(machine: Machine) -> dict[str, dict[str, Any]]:
    """Return the tables of the machine's file with its words and its numbers, SI."""
    literals, tables = machine.family.literals, machine.family_tables
    names = [name for name in dict.fromkeys([*literals, *tables]) if name.startswith(("legs.", "sections."))]
    return {name: {**literals.get(name, {}), **(vars(tables[name]) if name in tables else {})} for name in names}


def _by_leg(document: Mapping[str, Entry]) -> dict[str, dict[str, dict[str, Any]]]:
    """Return joints and links of each leg as they are written, by name.

    A series of parts, which is a table of its own, becomes the `stiffness` of its joint.
    """
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


def _copies(name: str, entry: Entry) -> Iterator[tuple[str, Array]]:
    """Give the names of the legs that a written leg stands for, and the rotation or reflection into each [3 x 3]."""
    if "copies" not in entry:
        yield name, np.eye(3)
        return
    images = [np.eye(3), np.diag([1.0, -1.0, 1.0])] if entry["mirrored"] else [np.eye(3)]
    turns = entry["copies"] // len(images)
    angles = [parse(angle, "angle") for angle in entry.get("angles", ())]
    angles = angles or [2.0 * math.pi * i / turns for i in range(turns)]
    places = [turn(np.array([0.0, 0.0, 1.0]), angle) @ image for angle in angles for image in images]
    yield from ((f"{name} {i}", place) for i, place in enumerate(places, 1))


def _entry_of_copy(entry: Entry, place: Array) -> dict[str, Any]:
    """Return a joint or link with its points, directions and matrices where a copy of its leg has them.

    Args:
        entry: the joint or link as it is written.
        place: rotation of the copy, with a reflection of a mirrored one, which turns rotations the other way [3 x 3].
    """
    placed = dict(entry)
    for key, value in entry.items():
        if key == "inertia":
            placed[key] = place @ matrix_of(value) @ place.T
        elif key == "compliance":
            turning = np.kron(np.diag([np.linalg.det(place), 1.0]), place)
            placed[key] = turning @ np.asarray(value) @ turning.T
        elif isinstance(value, tuple | list) and len(value) == 3 and key != "joins":
            placed[key] = place @ np.asarray(value, dtype=float)
    return placed


def _moving_leg(name: str, joints: Sequence[Entry], links: Mapping[str, Entry], document: Entry) -> MovingLeg:
    """Return a leg: the parts of its first joint, then those of each link and of the joint behind it."""
    parts = _parts_of_joint(name, joints[0], document)
    bodies: list[LegBody] = []
    moves = False
    for joint, following in pairwise(joints):
        moves = moves or joint["type"] != "fixed"
        body = joint["joins"][1]
        link, ends = links.get(body, {}), (np.asarray(joint.get("far", joint["point"])), np.asarray(following["point"]))
        springs = _parts_of_link(PartName(name, body), link, ends, document)
        if moves:
            of_struts = [other["section"] for other in joints if body in other["joins"] and "section" in other]
            section = next(iter([link["section"]] if "section" in link else of_struts), "")
            carriers = len(parts), len(parts) + len(springs)
            bodies.append(_body(f"{name} {body}", link, ends, carriers, document.get(f"sections.{section}")))
        parts += [*springs, *_parts_of_joint(name, following, document)]
    return MovingLeg(name, tuple(parts), tuple(bodies))


def _parts_of_joint(leg: str, joint: Entry, document: Entry) -> list[LegPart]:
    """Return the parts of a joint: its freedoms, of which one may have springs in a row and a rod, and its bearings."""
    name, kind = PartName(leg, joint["name"]), joint["type"]
    moving = [LegPart(element, moves=True) for element in _elements(name, joint)]
    if "stiffness" in joint:
        actuated = joint.get("actuated", False)
        order = FREEDOM_ORDER.get(kind, tuple(JOINT_TYPES[kind].motors))
        driven = 0 if isinstance(actuated, bool) else order.index(actuated)
        freedom = joint_in(moving[driven].element)
        in_series = _springs_in_series(name, freedom, joint, bool(actuated))
        axial_rigidity = _axial_rigidity(joint, document)
        if axial_rigidity is not None:
            freedom_of_rod = replace(freedom, carriage=vector(joint["point"]))
            rod = Spring(PartName(leg, f"{joint['name']} rod"), freedom_of_rod, RIGID)
            in_series.append(LegPart(rod, axial_rigidity=float(axial_rigidity)))
        moving[driven : driven + 1] = in_series
    bearings = [LegPart(spring) for spring in _bearings(name, joint)]
    travel = BEARINGS_TRAVEL[kind] if kind in BEARINGS_TRAVEL else JOINT_TYPES[kind].bearings_travel
    return [*moving, *bearings] if travel and "compliance" not in joint else [*bearings, *moving]


def _elements(name: PartName, joint: Entry) -> Sequence[Element]:
    """Return the elements of a joint that move, from the base side to the platform side."""
    kind = joint["type"]
    if kind == "parallelogram":
        ends = vector(joint["point"]), vector(joint["far"])
        return [Parallelogram(name, *ends, vector(unit(joint["axis"])), joint["width"], joint["bar_stiffness"])]
    if kind in BEARINGS_TRAVEL:
        return [replace(freedom, name=name) for freedom in _freedoms(joint)]
    motor = JOINT_TYPES[kind].motors.get(joint.get("actuated", ""))
    make = motor.elements if motor and motor.elements else JOINT_TYPES[kind].elements
    return make(name, SimpleNamespace(**joint))


def _freedoms(joint: Entry) -> list[Joint]:
    """Return the freedoms of a joint of a known type, from the base side to the platform side."""
    kind, point = joint["type"], vector(joint["point"])
    if kind == "fixed":
        return []
    if "first_axis" not in joint:
        axes = np.eye(3) if kind == "spherical" else [unit(joint["axis"])]
    else:
        first_two = unit(joint["first_axis"]), unit(joint["second_axis"])
        axes = [*first_two, unit(np.cross(*first_two))]
    slides = {"prismatic": (0,), "planar": (0, 1)}.get(kind, ())
    count = {"universal": 2, "planar": 3, "spherical": 3}.get(kind, 1)
    directions = [vector(axis) for axis in axes[:count]]
    pitch = joint.get("pitch", 0.0)
    freedoms = [Joint(axis) if i in slides else Joint(axis, point, pitch=pitch) for i, axis in enumerate(directions)]
    return [*freedoms, Joint(directions[0])] if kind == "cylindrical" else freedoms


def _springs_in_series(name: PartName, freedom: Joint, joint: Entry, actuated: bool) -> list[LegPart]:
    """Return the springs on a freedom, one or several in a row, of which the first one moves."""
    stiffness = joint["stiffness"]
    first, *others = stiffness.values() if isinstance(stiffness, dict) else [stiffness]
    spring = Spring(name, freedom, first, part=name, acts=joint.get("acts", ""))
    moving = replace(spring, actuated=actuated, hinge=not actuated)
    return [LegPart(moving, moves=True), *(LegPart(replace(spring, stiffness=other)) for other in others)]


def _axial_rigidity(joint: Entry, document: Entry) -> float | None:
    """Return E A of the rod of a strut, N; None if the joint has none."""
    if "section" in joint:
        return float(_rigidity(document[f"sections.{joint['section']}"]).axial)
    return joint.get("axial_rigidity")


def _rigidity(section: Entry, shear: bool = False) -> Rigidity:
    return rigidity_of(section["shape"], SimpleNamespace(**section), shear)


def _bearings(name: str, joint: Entry) -> Sequence[Spring]:
    """Return the springs of the bearings of a joint, from a matrix or in the directions of its axis."""
    point = vector(joint["point"])
    if "compliance" in joint:
        return matrix_springs(name, joint["compliance"], point)
    stiffnesses = {key.removeprefix("stiffness_"): joint[key] for key in joint if key.startswith("stiffness_")}
    if not stiffnesses:
        return ()
    axis = unit(joint["axis"] if "axis" in joint else np.cross(unit(joint["first_axis"]), unit(joint["second_axis"])))
    y = unit(np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis))
    along, *across = vector(axis), vector(y), vector(np.cross(axis, y))
    freedoms = {
        "axial": [Joint(along)],
        "radial": [Joint(direction) for direction in across],
        "torsion": [Joint(along, point)],
        "tilt": [Joint(direction, point) for direction in across],
    }
    return [Spring(f"{name} {kind}", freedom, k) for kind, k in stiffnesses.items() for freedom in freedoms[kind]]


def _parts_of_link(name: PartName, link: Entry, ends: tuple[Array, Array], document: Entry) -> list[LegPart]:
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
    turning = (
        (along, rigidity.torsion),
        (y, BENDING_OF_TIP * rigidity.bending_y),
        (np.cross(along, y), BENDING_OF_TIP * rigidity.bending_z),
    )
    springs = [Spring(name, Joint(vector(axis), start), k / length) for axis, k in turning]
    return [*map(LegPart, springs), LegPart(Spring(name, Joint(vector(along)), rigidity.axial / length))]


def _body(name: str, link: Entry, ends: tuple[Array, Array], parts: tuple[int, int], section: Entry | None) -> LegBody:
    """Return a link with its mass: that of the file, otherwise what its cross-section weighs over its length."""
    density = linear_density_of(section["shape"], SimpleNamespace(**section)) if section else 0.0
    body = LegBody(name, float(density) * float(np.linalg.norm(ends[1] - ends[0])), ends, parts)
    if "mass" not in link:
        return body
    return replace(body, mass=link["mass"], centre=link.get("centre_of_mass"), inertia=link.get("inertia"))


def with_legs_of_file(machine: Machine, ours: Configuration) -> Configuration:
    """Return the machine with its actuated legs where the file puts them; other families are left as they are.

    Args:
        machine: a machine of any family, at its pose.
        ours: its configuration by kinetostat, from which passive legs and the assembly mode are taken.
    """
    kind = machine.family.name.removesuffix(CRANKS_SUFFIX)
    if kind not in PLATFORMS and kind not in GUIDED:
        return ours
    if kind in PLATFORMS:
        place = PLATFORMS[kind](machine.tables["pose"])
    else:
        place = placement(columns(ours.platform.rotation), array(ours.platform.translation))
    build = _crank_leg if machine.family.name.endswith(CRANKS_SUFFIX) else _strut_leg
    ends = iter(zip(*_rings(machine, place), strict=True))
    legs, number = [], 0
    for leg in ours.legs:
        if leg.number is not None:
            chain = build(machine, number, next(ends), leg)
            leg, number = Leg(leg.name, tuple(chain), leg.lines, number=leg.number), number + 1
        legs.append(leg)
    return Configuration(_displacement(place), tuple(legs), (), ours.length, ours.plane)


def _rings(machine: Machine, place: Array) -> tuple[list[Array], list[Array]]:
    """Return the base and platform joints of the actuated legs, in order."""
    numbers = vars(machine.tables["geometry"])
    rings = []
    for name in ("base", "platform"):
        first, quarter = numbers.get(f"{name}_angle", 0.0), math.pi / 2.0
        angles = numbers.get(f"{name}_angles", (first, quarter + first, -quarter - first, -first))
        radius, height = numbers[f"{name}_radius"], numbers.get(f"{name}_height", 0.0)
        rings.append([np.array([radius * math.cos(a), radius * math.sin(a), height]) for a in angles])
    return rings[0], [apply(place, point) for point in rings[1]]


def _drive_springs(machine: Machine, number: int, freedom: Joint) -> list[Spring]:
    """Return the springs of an actuator: one, or those of its parts in a row."""
    series = machine.tables.get("stiffness.actuator")
    rows = [machine.tables["stiffness"].actuator] if series is None else list(vars(series).values())
    return [Spring("actuator", freedom, row[number], actuated=i == 0) for i, row in enumerate(rows)]


def _link_springs(freedom: Joint, rigidity: float, length: float, factor: float = 1.0) -> list[Spring]:
    """Return a spring of a link over its whole length; none if it is rigid."""
    return [] if math.isinf(rigidity) else [Spring("link", freedom, factor * rigidity / length)]


def _strut_leg(machine: Machine, number: int, ends: tuple[Array, Array], _ours: Leg) -> Sequence[Element]:
    """Return a slide between two spherical joints; of a planar machine, between two revolutes."""
    low, high = ends
    axes = (AXES[2],) if machine.family.planar else AXES
    along, length = Joint(vector(unit(high - low))), float(np.linalg.norm(high - low))
    rod = _link_springs(along, float(machine.tables["stiffness"].leg_axial), length)
    return [*_ball(low, axes), *_drive_springs(machine, number, along), *rod, *_ball(high, axes)]


def _crank_leg(machine: Machine, number: int, ends: tuple[Array, Array], ours: Leg) -> Sequence[Element]:
    """Return a crank in a vertical plane and a rod, with its elbow on the side where kinetostat has it."""
    (low, high), geometry, stiffness = ends, machine.tables["geometry"], machine.tables["stiffness"]
    side = turn(Z, geometry.crank_turn[number]) @ unit([low[0], low[1], 0.0])
    crank, rod, span = float(geometry.crank_length), float(geometry.rod_length), high - low
    across, up = float(span @ side), float(span @ Z)
    middle = math.atan2(up, across)
    half = math.acos((span @ span + crank**2 - rod**2) / (2.0 * crank * math.hypot(across, up)))
    elbows = [low + crank * (math.cos(a) * side + math.sin(a) * Z) for a in (middle + half, middle - half)]
    (arm,) = [element for element in ours.chain if isinstance(element, Arm)]
    elbow = min(elbows, key=lambda point: float(np.linalg.norm(point - array(arm.end))))
    axis = np.cross(Z, side)
    pivot, sideways = Joint(vector(axis), vector(low)), Joint(vector(np.cross(axis, unit(elbow - low))), vector(low))
    along = Joint(vector(unit(high - elbow)))
    bending = [
        *_link_springs(pivot, stiffness.crank_bending, crank, BENDING_OF_TIP),
        *_link_springs(sideways, stiffness.crank_bending, crank, BENDING_OF_TIP),
    ]
    stretch = _link_springs(along, stiffness.leg_axial, rod)
    bar = Arm(vector(low), vector(elbow))
    return [*_drive_springs(machine, number, pivot), *bending, bar, *_ball(elbow, AXES), *stretch, *_ball(high, AXES)]


def _ball(centre: Array, axes: Sequence[Vector]) -> list[Joint]:
    return [Joint(axis, vector(centre)) for axis in axes]
