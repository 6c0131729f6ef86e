"""A machine as Extended URDF: a tree of links and joints, the loops that close it, and the stiffnesses.

The dialect is described in docs/export.md. Loops stand twice: as elements <loop> in the file, and as pairs of frames in
a YAML file beside it, as the toolbox for parallel robots on Pinocchio reads them. `urdf_machine` reads the first.
Sources: Chignoli et al. 2024, URDF+ (<loop>); Batto et al. 2023, Extended URDF (YAML).
"""

import json
import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import numpy.typing as npt

from kinetostat.exchange.names import printable
from kinetostat.exchange.results import reference_point
from kinetostat.exchange.urdf_joints import OPPOSITE, TIP, UrdfJoint, joints_of
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.leg import Leg
from kinetostat.machine.machine import Configuration
from kinetostat.machine.written.plan import BASE, PLATFORM
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.storage import write_text
from kinetostat.validation.pieces import array

Array = npt.NDArray[np.float64]

TOOL = "tool"
THICKNESS = 0.02
"""Radius of a link in the picture, as a share of the machine's characteristic length."""
STROKE = 10.0
"""Limit of a slide from the pose, in machine lengths: URDF wants one where we know none."""
EFFORT, VELOCITY = 1e6, 1.0
"""Limits of effort (N) and velocity (m/s), likewise."""


class _Tree:
    """The file while it is written: every name is given once."""

    def __init__(self, analysis: Analysis, configuration: Configuration) -> None:
        planar = configuration.plane is not None
        self.robot = Element("robot", name=printable(analysis.machine.name))
        about = {"space": "planar" if planar else "spatial", "platform": PLATFORM, "tool": TOOL}
        SubElement(self.robot, "kinetostat", about)
        self._names: Counter[str] = Counter((BASE, PLATFORM, TOOL))
        self._size = float(configuration.length)
        self.motors: list[str] = []
        self.loops: list[tuple[str, str]] = []
        self._platform = array(configuration.platform.translation)
        self.link(BASE)
        self._first, *others = [self._leg(leg) for leg in configuration.legs]
        name, at = self._first
        self._join(UrdfJoint(f"{name} {PLATFORM}", "fixed", self._platform), name, PLATFORM, at)
        self._join(UrdfJoint(TOOL, "fixed", np.array(reference_point(analysis))), PLATFORM, TOOL, self._platform)
        for tip, place in others:
            self._close(tip, place)

    def link(self, name: str, reach: Array | None = None) -> None:
        """A link, seen as a rod from its origin to a point of it, m."""
        element = SubElement(self.robot, "link", name=name)
        length = 0.0 if reach is None else float(np.linalg.norm(reach))
        if reach is not None and length > THICKNESS * self._size:
            visual = SubElement(element, "visual")
            tilt = (
                0.0,
                float(np.arctan2(np.hypot(reach[0], reach[1]), reach[2])),
                float(np.arctan2(reach[1], reach[0])),
            )
            SubElement(visual, "origin", xyz=_n(*(reach / 2.0)), rpy=_n(*tilt))
            geometry = SubElement(visual, "geometry")
            SubElement(geometry, "cylinder", radius=_n(THICKNESS * self._size), length=_n(length))

    def _unique(self, name: str) -> str:
        word = _word(name)
        self._names[word] += 1
        return word if self._names[word] == 1 else self._unique(f"{word}_{self._names[word]}")

    def _leg(self, leg: Leg) -> tuple[str, Array]:
        """All of a leg; returns the name and the place of its last link."""
        parent, at = BASE, np.zeros(3)
        joints = list(joints_of(leg))
        before = ""
        for i, joint in enumerate(joints):
            last = i == len(joints) - 1
            child = self._unique(f"{leg.name}{TIP}" if last else f"{leg.name} body {i + 1}")
            reach = (self._platform if last else joints[i + 1].at) - joint.at
            before = self._join(joint, parent, child, at, reach, before)
            parent, at = child, joint.at
        if not joints:
            parent, at = self._unique(f"{leg.name}{TIP}"), self._platform
            self._join(UrdfJoint(f"{leg.name} foot", "fixed", at), BASE, parent, np.zeros(3))
        return parent, at

    def _join(
        self, joint: UrdfJoint, parent: str, child: str, at: Array, reach: Array | None = None, before: str = ""
    ) -> str:
        """A joint and the link after it; `at` is the parent's origin, base frame, m. Returns the joint's name."""
        self.link(child, reach)
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
            SubElement(element, "mimic", joint=before, multiplier=_n(OPPOSITE), offset="0")
        if joint.extension:
            SubElement(element, "kinetostat", joint.extension)
        if joint.extension.get("actuated"):
            self.motors.append(name)
        return name

    def _close(self, tip: str, at: Array) -> None:
        """Hold the tip of a leg in its seat on the platform."""
        seat = self._unique(f"{tip} seat")
        self._join(UrdfJoint(seat, "fixed", at), PLATFORM, seat, self._platform)
        loop = SubElement(self.robot, "loop", name=self._unique(f"{tip} loop"), type="fixed")
        for end, link in (("predecessor", seat), ("successor", tip)):
            SubElement(SubElement(loop, end, link=link), "origin", xyz="0 0 0", rpy="0 0 0")
        self.loops.append((seat, tip))


def texts_of(analysis: Analysis) -> tuple[str, str]:
    """The URDF, with all joint coordinates zero at the pose, and the YAML of its closed loops."""
    tree = _Tree(analysis, respond(analysis.machine).configuration)
    ElementTree.indent(tree.robot, "  ")
    text = '<?xml version="1.0"?>\n' + ElementTree.tostring(tree.robot, encoding="unicode") + "\n"
    lists = {
        "closed_loop": [list(pair) for pair in tree.loops],
        "type": ["6d"] * len(tree.loops),
        "name_mot": tree.motors,
    }
    return text, "".join(f"{name}: {json.dumps(entries)}\n" for name, entries in lists.items())


def _word(name: str) -> str:
    """A name without blanks and signs, which not every reader of URDF takes."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "unnamed"


def _n(*numbers: float) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(number)) for number in numbers)


def write(analysis: Analysis, path: Path) -> list[Path]:
    """Write the URDF, and the YAML of its loops beside it.

    Raises:
        InputError: if the file is called as the one beside it.
    """
    text, loops = texts_of(analysis)
    beside = path.with_suffix(".yaml")
    if beside == path:
        raise InputError(f'"{path}" is where the closed loops go; give the URDF another suffix, e.g. .urdf.')
    write_text(path, text)
    write_text(beside, loops)
    return [path, beside]
