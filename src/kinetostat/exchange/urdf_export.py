"""A machine as Extended URDF: a tree of links and joints, the loops that close it, and the stiffnesses.

The dialect is described in docs/export.md. Loops are written twice: as elements <loop> in the file, and as pairs of
frames in a YAML file next to it, as the toolbox for parallel robots on Pinocchio reads them. `urdf_import` reads the
first. Every frame is parallel to the base frame at the pose, so that axes and compliances are written as they are.

Sources: Chignoli et al. 2024, URDF+ (<loop>); Batto et al. 2023, Extended URDF (YAML).
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field
from itertools import combinations_with_replacement, groupby
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.exchange.formats import one_line, reference_point
from kinetostat.exchange.leg_by_leg import compliance_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import Element, Joint, Leg, Spring
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.loads import located_members
from kinetostat.machine.machine import Configuration, Machine, Member
from kinetostat.machine.written.plan import BASE, PLATFORM
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import replacing
from kinetostat.tolerances import COINCIDENT_HINGES
from kinetostat.validation.pieces import Heavy, array, matrix_of, on_platform, one_body, thin_rod

TIP = "_tip"
"""End of the name of the last link of a leg; what stands before it is the leg's."""
MIMIC_RATIO = -1.0
"""Turn of the second joint of a parallelogram while the first one turns by one."""
TOOL = "tool"
ROD_RADIUS = 0.02
"""Radius of a link in the picture, as a share of the machine's characteristic length: that of a slender strut."""
STROKE = 10.0
"""Limit of a slide from the pose, in machine lengths: URDF requires one, which should stop no motion of the machine."""
EFFORT = 1e6
"""Limit of the effort of a slide, N: URDF requires one, and no machine of these sizes carries as much."""
VELOCITY = 1e3
"""Limit of the velocity of a slide, m/s: URDF requires one, which should stop no motion either."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as URDF has it, with an extension for what URDF cannot say.

    Attributes:
        name: its name, which need not be unique yet.
        kind: "continuous", "prismatic" or "fixed".
        origin: its origin, base frame, m.
        axis: unit vector; None if it is fixed.
        extension: attributes of its element <kinetostat>.
        mimics: whether it turns as far as the joint before it, the other way.
    """

    name: str
    kind: str
    origin: Array
    axis: Array | None = None
    extension: dict[str, str] = field(default_factory=dict)
    mimics: bool = False


@dataclass(frozen=True)
class _Carrier:
    """A link of the URDF within a leg.

    Attributes:
        elements: number of elements of the leg's chain that end with its joint.
        joint: the joint before it.
        link: its name.
    """

    elements: int
    joint: UrdfJoint
    link: str


class _Tree:
    """The file while it is written; every name in it is unique.

    It is made with all its links and joints; masses may follow.
    """

    def __init__(self, analysis: Analysis, configuration: Configuration) -> None:
        planar = configuration.plane is not None
        self.robot = ElementTree.Element("robot", name=one_line(analysis.machine.name))
        attributes = {"space": "planar" if planar else "spatial", "platform": PLATFORM, "tool": TOOL}
        SubElement(self.robot, "kinetostat", attributes)
        self._names: Counter[str] = Counter((BASE, PLATFORM, TOOL))
        self._size = float(configuration.length)
        self.motors: list[str] = []
        self.loops: list[tuple[str, str]] = []
        self._platform = array(configuration.platform.translation)
        self._links: dict[str, tuple[ElementTree.Element, Array]] = {}
        self._carriers: list[list[_Carrier]] = []
        self._add_link(BASE, np.zeros(3))
        first_tip, *other_tips = [self._add_leg(leg) for leg in configuration.legs]
        self._add_joint(UrdfJoint(f"{first_tip} {PLATFORM}", "fixed", self._platform), first_tip, PLATFORM)
        self._add_joint(UrdfJoint(TOOL, "fixed", np.array(reference_point(analysis))), PLATFORM, TOOL)
        for tip in other_tips:
            self._close(tip)

    def add_masses(self, machine: Machine, response: Response, joints: Joints | None) -> None:
        """Add what weighs something to the links, as far as a link carries it whole.

        Args:
            machine: the machine with its masses.
            response, joints: its response, and its joints where it is written leg by leg.
        """
        parts: dict[str, list[Heavy]] = {
            PLATFORM: [part for part in on_platform(machine, response.configuration.platform) if part.mass]
        }
        missing_mass = 0.0
        names = [leg.name for leg in response.configuration.legs]
        # Members without a leg are those of the leg without an actuator, or of the first one where all are driven.
        passive = next((i for i, leg in enumerate(response.configuration.legs) if leg.number is None), 0)
        for member in located_members(machine, response.configuration, None if joints is None else joints.coordinates):
            if member.mass:
                number = names.index(member.leg) if member.leg else passive
                link, part = _rigid_part(member, self._carriers[number])
                if link:
                    parts.setdefault(link, []).append(part)
                else:
                    missing_mass += part.mass
        for name, heavy in parts.items():
            if heavy and name != BASE:
                self._add_inertial(*self._links[name], one_body(heavy))
        if missing_mass:
            text = "Links that bend, telescope or are parallelograms have a mass that is not written here"
            self.robot.append(ElementTree.Comment(f" {text}: {missing_mass:.6g} kg. "))

    def _add_inertial(self, link: ElementTree.Element, origin: Array, part: Heavy) -> None:
        element = SubElement(link, "inertial")
        SubElement(element, "origin", xyz=_digits_of(*(part.centre - origin)), rpy="0 0 0")
        SubElement(element, "mass", value=_digits_of(part.mass))
        pairs = combinations_with_replacement(range(3), 2)
        entries = {f"i{'xyz'[i]}{'xyz'[j]}": _digits_of(part.inertia[i, j]) for i, j in pairs}
        SubElement(element, "inertia", entries)

    def _add_link(self, name: str, origin: Array, reach: Array | None = None) -> None:
        """Add a link with its origin (base frame, m), drawn as a rod from there to the point `reach` on it, m."""
        element = SubElement(self.robot, "link", name=name)
        self._links[name] = element, origin
        length = 0.0 if reach is None else float(np.linalg.norm(reach))
        if reach is not None and length > ROD_RADIUS * self._size:
            visual = SubElement(element, "visual")
            x, y, z = reach
            pitch, yaw = float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x))
            SubElement(visual, "origin", xyz=_digits_of(*(reach / 2.0)), rpy=_digits_of(0.0, pitch, yaw))
            geometry = SubElement(visual, "geometry")
            SubElement(geometry, "cylinder", radius=_digits_of(ROD_RADIUS * self._size), length=_digits_of(length))

    def _unique(self, name: str) -> str:
        word = _plain_name(name)
        self._names[word] += 1
        return word if self._names[word] == 1 else self._unique(f"{word}_{self._names[word]}")

    def _add_leg(self, leg: Leg) -> str:
        """Add a whole leg, and return the name of its last link."""
        leg_joints = list(joints_of(leg)) or [(0, UrdfJoint(f"{leg.name} foot", "fixed", self._platform))]
        ends = [*(joint.origin for _, joint in leg_joints[1:]), self._platform]
        link, joint_before, carriers = BASE, "", []
        for i, ((elements, joint), end) in enumerate(zip(leg_joints, ends, strict=True), 1):
            child = self._unique(f"{leg.name}{TIP}" if i == len(leg_joints) else f"{leg.name} body {i}")
            joint_before = self._add_joint(joint, link, child, end - joint.origin, joint_before)
            link = child
            if elements:  # a foot carries nothing that moves
                carriers.append(_Carrier(elements, joint, child))
        self._carriers.append(carriers)
        return link

    def _add_joint(
        self, joint: UrdfJoint, parent: str, child: str, reach: Array | None = None, joint_before: str = ""
    ) -> str:
        """Add a joint and the link after it, and return the joint's name; for `reach` see `_add_link`."""
        self._add_link(child, joint.origin, reach)
        name = self._unique(joint.name)
        element = SubElement(self.robot, "joint", name=name, type=joint.kind)
        SubElement(element, "parent", link=parent)
        SubElement(element, "child", link=child)
        SubElement(element, "origin", xyz=_digits_of(*(joint.origin - self._links[parent][1])), rpy="0 0 0")
        if joint.axis is not None:
            SubElement(element, "axis", xyz=_digits_of(*joint.axis))
        if joint.kind == "prismatic":
            limits = {"lower": -STROKE * self._size, "upper": STROKE * self._size}
            limits |= {"effort": EFFORT, "velocity": VELOCITY}
            SubElement(element, "limit", {limit: _digits_of(value) for limit, value in limits.items()})
        if joint.mimics:
            SubElement(element, "mimic", joint=joint_before, multiplier=_digits_of(MIMIC_RATIO), offset="0")
        if joint.extension:
            SubElement(element, "kinetostat", joint.extension)
        if joint.extension.get("actuated"):
            self.motors.append(name)
        return name

    def _close(self, tip: str) -> None:
        """Close a loop: fix the tip of a leg to its seat on the platform."""
        seat = self._unique(f"{tip} seat")
        self._add_joint(UrdfJoint(seat, "fixed", self._links[tip][1]), PLATFORM, seat)
        loop = SubElement(self.robot, "loop", name=self._unique(f"{tip} loop"), type="fixed")
        for end, link in (("predecessor", seat), ("successor", tip)):
            SubElement(SubElement(loop, end, link=link), "origin", xyz="0 0 0", rpy="0 0 0")
        self.loops.append((seat, tip))


def texts_of(analysis: Analysis) -> tuple[str, str]:
    """Return the URDF, with all joint coordinates zero at the pose, and the YAML of its closed loops."""
    machine = analysis.machine
    response = analysis.state.free
    tree = _Tree(analysis, response.configuration)
    tree.add_masses(machine, response, analysis.state.joints)
    ElementTree.indent(tree.robot, "  ")
    text = '<?xml version="1.0"?>\n' + ElementTree.tostring(tree.robot, encoding="unicode") + "\n"
    lists = {
        "closed_loop": [list(pair) for pair in tree.loops],
        "type": ["6d"] * len(tree.loops),
        "name_mot": tree.motors,
    }
    return text, "".join(f"{name}: {json.dumps(entries)}\n" for name, entries in lists.items())


def _plain_name(name: str) -> str:
    """Return a name without blanks and signs, which not every reader of URDF takes."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "unnamed"


def _digits_of(*numbers: float) -> str:
    """Return the numbers with all their digits."""
    return " ".join(repr(float(number)) for number in numbers)


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the URDF, and the YAML of its loops next to it.

    Raises:
        InputError: if both files would have the same name.
    """
    text, loops = texts_of(analysis)
    loops_path = path.with_suffix(".yaml")
    if loops_path == path:
        raise InputError(
            f'"{path}" is the name of the file of the closed loops; give the URDF another suffix, e.g. .urdf.'
        )
    with replacing(path) as first, replacing(loops_path) as second:
        first.write_text(text, encoding="utf-8")
        second.write_text(loops, encoding="utf-8")
    return [path, loops_path]


def _rigid_part(link: Member, carriers: Sequence[_Carrier]) -> tuple[str, Heavy]:
    """Return the URDF link that carries a link of the machine, or an empty name, and the link as a rigid mass.

    A hinge through the end of a uniform rod moves that end with what is on either side of it.
    """
    names = [BASE, *(carrier.link for carrier in carriers)]
    mass = float(link.mass)
    if link.centre is not None:
        elements, centre = link.centre()
        inertia = np.zeros((3, 3)) if link.inertia is None else matrix_of(link.inertia())
        return names[_count_within(carriers, elements)], Heavy(mass, array(centre), inertia)
    ends = link.ends() if link.ends else ()
    if len(ends) != 2:
        return "", Heavy(mass, np.zeros(3), np.zeros((3, 3)))
    first, last = (_count_within(carriers, elements) for elements, _ in ends)
    start, end = (array(point) for _, point in ends)
    while first < last and _is_hinge_at(carriers[first].joint, start):
        first += 1
    while first < last and _is_hinge_at(carriers[last - 1].joint, end):
        last -= 1
    return names[first] if first == last else "", thin_rod(mass, start, end)


def _count_within(carriers: Sequence[_Carrier], elements: int) -> int:
    """Return the number of carriers whose joints end within the first elements of a leg's chain."""
    return sum(carrier.elements <= elements for carrier in carriers)


def _is_hinge_at(joint: UrdfJoint, point: Array) -> bool:
    """Return whether a joint turns about a line through a point, and nothing else."""
    if joint.kind != "continuous" or joint.axis is None or "pitch" in joint.extension:
        return False
    return float(np.linalg.norm(np.cross(joint.origin - point, joint.axis))) < COINCIDENT_HINGES


def joints_of(leg: Leg) -> Iterator[tuple[int, UrdfJoint]]:
    """Give the joints of a leg at the pose, from base to platform, each with the number of elements up to its own.

    A joint, or a spring that is driven or a hinge, becomes a joint that moves. The springs of one link or bearing
    together become a fixed joint with a compliance. A parallelogram becomes two revolutes, of which the second turns
    back what the first turned.
    """
    last_origin = np.zeros(3)
    for i, element in enumerate(leg.chain, 1):
        following = (array(point) for other in leg.chain[i:] for point in _places(other))
        for joint in _joints_of_element(leg.name, element, last_origin, next(following, last_origin)):
            yield i, joint
            last_origin = joint.origin


def _places(element: Element) -> Sequence[Vector]:
    """Return the points at which an element lies; none for a slide."""
    point = element.mover.point if isinstance(element, Joint | Spring) else None
    return element.path or (() if point is None else (point,))


def _joints_of_element(leg: str, element: Element, before: Array, after: Array) -> Iterator[UrdfJoint]:
    """Give the joints of an element between two points: the last joint's origin, and the next element's place."""
    if isinstance(element, Parallelogram):
        yield from _parallelogram(element)
    elif isinstance(element, Joint):
        yield _moving_joint(element.name or f"{leg} joint", element, after, {})
    elif isinstance(element, Spring) and (element.actuated or element.hinge):
        role = {"actuated": "true"} if element.actuated else {}
        stiffness = "rigid" if math.isinf(element.stiffness) else repr(float(element.stiffness))
        name = (element.part or element.name).replace("actuator", "drive")  # an actuator is named after its joint again
        yield _moving_joint(name, element.joint, after, {"stiffness": stiffness, **role})
    else:
        yield from _bearings(element.springs, before)


def _moving_joint(name: str, joint: Joint, after: Array, extension: dict[str, str]) -> UrdfJoint:
    """Return a joint that moves; a slide, which has no place, is put where the next element is."""
    if joint.pitch != 0.0:
        extension = {**extension, "pitch": repr(float(joint.pitch))}
    if joint.point is None:
        return UrdfJoint(name, "prismatic", after, array(joint.axis), extension)
    return UrdfJoint(name, "continuous", array(joint.point), array(joint.axis), extension)


def _bearings(springs: Sequence[Spring], before: Array) -> Iterator[UrdfJoint]:
    """Give the springs of one part as a fixed joint with a 6x6 compliance; one without stiffness as a free joint."""
    for (part, is_free), group in groupby(springs, lambda s: (s.part or s.name, s.stiffness == 0.0)):
        part_springs = list(group)
        if is_free:
            yield from (_moving_joint(spring.name, spring.joint, before, {}) for spring in part_springs)
            continue
        points = [spring.joint.point for spring in part_springs if spring.joint.point is not None]
        origin = array(points[0]) if points else before
        matrix = compliance_at(part_springs, Vector(*origin.tolist()))
        if np.any(matrix):
            yield UrdfJoint(part, "fixed", origin, extension={"compliance": _digits_of(*matrix.ravel())})


def _parallelogram(piece: Parallelogram) -> Iterator[UrdfJoint]:
    normal = array(piece.normal)
    bar = "rigid" if math.isinf(piece.bar) else repr(float(piece.bar))
    side = _digits_of(*array(piece.side))
    extension = {"parallelogram": side, "width": repr(float(piece.width)), "bar_stiffness": bar}
    yield UrdfJoint(f"{piece.name} near", "continuous", array(piece.near), normal)
    yield UrdfJoint(f"{piece.name} far", "continuous", array(piece.far), normal, extension, mimics=True)
