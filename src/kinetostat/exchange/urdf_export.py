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
"""Limit of a slide from the pose, in machine lengths: URDF requires one and the machine file has none."""
EFFORT, VELOCITY = 1e6, 1.0
"""Limits of effort (N) and velocity (m/s), which URDF wants as well."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as URDF has it, with an extension for what URDF cannot say.

    Attributes:
        name: not yet unique.
        kind: "continuous", "prismatic" or "fixed".
        at: its origin, base frame, m.
        axis: unit vector; None if it is fixed.
        extension: attributes of its element <kinetostat>.
        mimics: whether it turns as far as the joint before it, the other way.
    """

    name: str
    kind: str
    at: Array
    axis: Array | None = None
    extension: dict[str, str] = field(default_factory=dict)
    mimics: bool = False


class _Tree:
    """The file while it is written; every name in it is unique."""

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
        self._carriers: list[list[tuple[int, UrdfJoint, str]]] = []
        self.link(BASE)
        self._first, *others = [self._leg(leg) for leg in configuration.legs]
        name, at = self._first
        self._join(UrdfJoint(f"{name} {PLATFORM}", "fixed", self._platform), name, PLATFORM, at)
        self._join(UrdfJoint(TOOL, "fixed", np.array(reference_point(analysis))), PLATFORM, TOOL, self._platform)
        for tip, place in others:
            self._close(tip, place)

    def weigh(self, machine: Machine, response: Response, joints: Joints | None) -> None:
        """Add what weighs something to the links, as far as a link carries it whole.

        Args:
            machine: the machine with its masses.
            response, joints: its response, and its joints where it is written leg by leg.
        """
        parts: dict[str, list[Heavy]] = {
            PLATFORM: [part for part in on_platform(machine, response.configuration.platform) if part.mass]
        }
        left: list[Heavy] = []
        names = [leg.name for leg in response.configuration.legs]
        free = next((i for i, leg in enumerate(response.configuration.legs) if leg.number is None), 0)
        for member in located_members(machine, response.configuration, None if joints is None else joints.coordinates):
            if member.mass:
                number = names.index(member.leg) if member.leg else free
                link, part = _whole(member, self._carriers[number])
                (parts.setdefault(link, []) if link else left).append(part)
        for name, heavy in parts.items():
            if heavy and name != BASE:
                self._inertial(*self._links[name], one_body(heavy))
        if left:
            text = "Links that bend, telescope or are parallelograms have a mass that is not written here"
            self.robot.append(ElementTree.Comment(f" {text}: {sum(part.mass for part in left):.6g} kg. "))

    def _inertial(self, link: ElementTree.Element, origin: Array, part: Heavy) -> None:
        element = SubElement(link, "inertial")
        SubElement(element, "origin", xyz=_n(*(part.centre - origin)), rpy="0 0 0")
        SubElement(element, "mass", value=_n(part.mass))
        entries = {
            f"i{'xyz'[i]}{'xyz'[j]}": _n(part.inertia[i, j]) for i, j in combinations_with_replacement(range(3), 2)
        }
        SubElement(element, "inertia", entries)

    def link(self, name: str, reach: Array | None = None, at: Array | None = None) -> None:
        """Add a link at a place (base frame, m), drawn as a rod from its origin to the point `reach` on it, m."""
        element = SubElement(self.robot, "link", name=name)
        self._links[name] = element, np.zeros(3) if at is None else at
        length = 0.0 if reach is None else float(np.linalg.norm(reach))
        if reach is not None and length > ROD_RADIUS * self._size:
            visual = SubElement(element, "visual")
            tilt = (
                0.0,
                float(np.arctan2(np.hypot(reach[0], reach[1]), reach[2])),
                float(np.arctan2(reach[1], reach[0])),
            )
            SubElement(visual, "origin", xyz=_n(*(reach / 2.0)), rpy=_n(*tilt))
            geometry = SubElement(visual, "geometry")
            SubElement(geometry, "cylinder", radius=_n(ROD_RADIUS * self._size), length=_n(length))

    def _unique(self, name: str) -> str:
        word = _word(name)
        self._names[word] += 1
        return word if self._names[word] == 1 else self._unique(f"{word}_{self._names[word]}")

    def _leg(self, leg: Leg) -> tuple[str, Array]:
        """Add a whole leg; return the name and the place of its last link."""
        parent, at = BASE, np.zeros(3)
        row = list(joints_of(leg))
        joints = [joint for _, joint in row]
        before, carriers = "", []
        for i, (elements, joint) in enumerate(row):
            last = i == len(joints) - 1
            child = self._unique(f"{leg.name}{TIP}" if last else f"{leg.name} body {i + 1}")
            reach = (self._platform if last else joints[i + 1].at) - joint.at
            before = self._join(joint, parent, child, at, reach, before)
            parent, at = child, joint.at
            carriers.append((elements, joint, child))
        self._carriers.append(carriers)
        if not joints:
            parent, at = self._unique(f"{leg.name}{TIP}"), self._platform
            self._join(UrdfJoint(f"{leg.name} foot", "fixed", at), BASE, parent, np.zeros(3))
        return parent, at

    def _join(
        self, joint: UrdfJoint, parent: str, child: str, at: Array, reach: Array | None = None, before: str = ""
    ) -> str:
        """Add a joint and the link after it and return the joint's name; `at` is the parent's origin, base frame, m."""
        self.link(child, reach, joint.at)
        name = self._unique(joint.name)
        element = SubElement(self.robot, "joint", name=name, type=joint.kind)
        SubElement(element, "parent", link=parent)
        SubElement(element, "child", link=child)
        SubElement(element, "origin", xyz=_n(*(joint.at - at)), rpy="0 0 0")
        if joint.axis is not None:
            SubElement(element, "axis", xyz=_n(*joint.axis))
        if joint.kind == "prismatic":
            stroke = STROKE * self._size
            limit = {"lower": _n(-stroke), "upper": _n(stroke), "effort": _n(EFFORT), "velocity": _n(VELOCITY)}
            SubElement(element, "limit", limit)
        if joint.mimics:
            SubElement(element, "mimic", joint=before, multiplier=_n(MIMIC_RATIO), offset="0")
        if joint.extension:
            SubElement(element, "kinetostat", joint.extension)
        if joint.extension.get("actuated"):
            self.motors.append(name)
        return name

    def _close(self, tip: str, at: Array) -> None:
        """Close a loop: fix the tip of a leg to its seat on the platform."""
        seat = self._unique(f"{tip} seat")
        self._join(UrdfJoint(seat, "fixed", at), PLATFORM, seat, self._platform)
        loop = SubElement(self.robot, "loop", name=self._unique(f"{tip} loop"), type="fixed")
        for end, link in (("predecessor", seat), ("successor", tip)):
            SubElement(SubElement(loop, end, link=link), "origin", xyz="0 0 0", rpy="0 0 0")
        self.loops.append((seat, tip))


def texts_of(analysis: Analysis) -> tuple[str, str]:
    """Return the URDF, with all joint coordinates zero at the pose, and the YAML of its closed loops."""
    machine = analysis.machine
    response = analysis.state.free
    tree = _Tree(analysis, response.configuration)
    tree.weigh(machine, response, analysis.state.joints)
    ElementTree.indent(tree.robot, "  ")
    text = '<?xml version="1.0"?>\n' + ElementTree.tostring(tree.robot, encoding="unicode") + "\n"
    lists = {
        "closed_loop": [list(pair) for pair in tree.loops],
        "type": ["6d"] * len(tree.loops),
        "name_mot": tree.motors,
    }
    return text, "".join(f"{name}: {json.dumps(entries)}\n" for name, entries in lists.items())


def _word(name: str) -> str:
    """Return a name without blanks and signs, which not every reader of URDF takes."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "unnamed"


def _n(*numbers: float) -> str:
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


def _whole(link: Member, carriers: Sequence[tuple[int, UrdfJoint, str]]) -> tuple[str, Heavy]:
    """Return the URDF link that carries a link of the machine, or an empty name, and the link as a rigid mass.

    A hinge through the end of a uniform rod moves that end with what is on either side of it.
    """
    behind = [BASE, *(child for _, _, child in carriers)]
    mass = float(link.mass)
    if link.centre is not None:
        elements, centre = link.centre()
        inertia = np.zeros((3, 3)) if link.inertia is None else matrix_of(link.inertia())
        return behind[sum(number <= elements for number, *_ in carriers)], Heavy(mass, array(centre), inertia)
    ends = link.ends() if link.ends else ()
    if len(ends) != 2:
        return "", Heavy(mass, np.zeros(3), np.zeros((3, 3)))
    first, last = (sum(number <= elements for number, *_ in carriers) for elements, _ in ends)
    start, end = (array(point) for _, point in ends)
    while first < last and _hinged_at(carriers[first][1], start):
        first += 1
    while first < last and _hinged_at(carriers[last - 1][1], end):
        last -= 1
    return behind[first] if first == last else "", thin_rod(mass, start, end)


def _hinged_at(joint: UrdfJoint, point: Array) -> bool:
    """Return whether a joint turns about a line through a point, and nothing else."""
    if joint.kind != "continuous" or joint.axis is None or "pitch" in joint.extension:
        return False
    return float(np.linalg.norm(np.cross(joint.at - point, joint.axis))) < COINCIDENT_HINGES


def joints_of(leg: Leg) -> Iterator[tuple[int, UrdfJoint]]:
    """Return the joints of a leg at the pose, from base to platform, each with how many elements end with its own.

    A joint, or a spring that is driven or a hinge, becomes a joint that moves. The springs of one link or bearing
    together become a fixed joint with a compliance. A parallelogram becomes two revolutes, of which the second turns
    back what the first turned.
    """
    at = np.zeros(3)
    for i, element in enumerate(leg.chain):
        places = [at, *(array(p) for after in leg.chain[i + 1 :] for p in _places(after))]
        for joint in _of_element(leg.name, element, at, places[min(1, len(places) - 1)]):
            yield i + 1, joint
            at = joint.at


def _places(element: Element) -> Sequence[Vector]:
    """Return the points at which an element lies; none for a slide."""
    point = element.mover.point if isinstance(element, Joint | Spring) else None
    return element.path or (() if point is None else (point,))


def _of_element(leg: str, element: Element, before: Array, after: Array) -> Iterator[UrdfJoint]:
    if isinstance(element, Parallelogram):
        yield from _parallelogram(element)
    elif isinstance(element, Joint):
        yield _moving(element.name or f"{leg} joint", element, after, {})
    elif isinstance(element, Spring) and (element.actuated or element.hinge):
        role = {"actuated": "true"} if element.actuated else {}
        stiffness = "rigid" if math.isinf(element.stiffness) else repr(float(element.stiffness))
        name = (element.part or element.name).replace("actuator", "drive")  # an actuator is named after its joint again
        yield _moving(name, element.joint, after, {"stiffness": stiffness, **role})
    else:
        yield from _bearings(element.springs, before)


def _moving(name: str, joint: Joint, after: Array, extension: dict[str, str]) -> UrdfJoint:
    """Return a joint that moves; a slide, which has no place, is put where the next element is."""
    if joint.pitch != 0.0:
        extension = {**extension, "pitch": repr(float(joint.pitch))}
    if joint.point is None:
        return UrdfJoint(name, "prismatic", after, array(joint.axis), extension)
    return UrdfJoint(name, "continuous", array(joint.point), array(joint.axis), extension)


def _bearings(springs: Sequence[Spring], before: Array) -> Iterator[UrdfJoint]:
    """The springs of one part as a fixed joint with a 6x6 compliance; a spring without stiffness as a free joint."""
    for (part, free), group in groupby(springs, lambda s: (s.part or s.name, s.stiffness == 0.0)):
        part_springs = list(group)
        if free:
            yield from (_moving(spring.name, spring.joint, before, {}) for spring in part_springs)
            continue
        points = [spring.joint.point for spring in part_springs if spring.joint.point is not None]
        at = array(points[0]) if points else before
        matrix = compliance_at(part_springs, Vector(*at.tolist()))
        if np.any(matrix):
            numbers = " ".join(repr(c) for c in matrix.ravel().tolist())
            yield UrdfJoint(part, "fixed", at, None, {"compliance": numbers})


def _parallelogram(piece: Parallelogram) -> Iterator[UrdfJoint]:
    normal = array(piece.normal)
    bar = "rigid" if math.isinf(piece.bar) else repr(float(piece.bar))
    side = " ".join(repr(c) for c in array(piece.side).tolist())
    extension = {"parallelogram": side, "width": repr(float(piece.width)), "bar_stiffness": bar}
    yield UrdfJoint(f"{piece.name} near", "continuous", array(piece.near), normal)
    yield UrdfJoint(f"{piece.name} far", "continuous", array(piece.far), normal, extension, mimics=True)
