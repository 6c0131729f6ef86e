"""Any machine as a file leg by leg, at its pose: joints by point and axis, and what deflects between them.

Actuators with springs in a row become series of parts; whatever else deflects between two joints becomes the 6x6 of a
link, which is exact. Points, axes and matrices are in the base frame at the pose, which is the file's home pose.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import count, groupby, pairwise
from typing import Any

import numpy as np

from kinetostat.accuracy.built import as_built
from kinetostat.algebra.vector import Rotation, Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.mobility import task_coordinates
from kinetostat.machine.common_tables import COMMON_TABLES, Load, Tool
from kinetostat.machine.leg import RIGID, Element, Joint, Leg, PartName, Spring
from kinetostat.machine.limits import LIMITS, OF_DRIVES, is_set, limits_set, unloaded_parts
from kinetostat.machine.link import Parallelogram
from kinetostat.machine.links import driven_slides, rods
from kinetostat.machine.loading import load
from kinetostat.machine.loads import turned_tensor
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.saving import as_file
from kinetostat.machine.written.plan import BASE, NAME, PLATFORM, SPATIAL_POSE
from kinetostat.spec.document import Document, toml_key, toml_pairs, toml_value
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import LARGEST_OTHER, quantities
from kinetostat.spec.validation import SCHEMA_VERSION
from kinetostat.studies.cleaning import clean_screw
from kinetostat.studies.identification.fitted_values import identified_machine
from kinetostat.studies.identification.identification import Identification

LONGEST_NEW_NAME = 30
"""Characters of the name of a joint or link that is made here: a number may follow it within what a file allows."""


def legs_of(name: str) -> str:
    """Return the text of a machine file leg by leg that is the same machine as a bundled one or one from a file.

    Args:
        name: the name of a bundled machine, or path of a machine file.

    Raises:
        InputError: no such machine, or it cannot be placed at its pose.
    """
    machine = load(name)
    document = document_of(machine)
    left_out = _limits_lost((limit.name for limit in limits_set(machine.tables["limits"])), document)
    note = f"# Left out, since the platform is tilted at this pose: {left_out}.\n" if left_out else ""
    return note + _text(document, machine)


def _limits_lost(limits: Iterable[str], document: Document) -> str:
    return ", ".join(f"limits.{name}" for name in limits if name not in document.get("limits", {}))


def built_text(machine: Machine, built: Configuration, notes: Sequence[str]) -> str:
    """Return the text of a machine file leg by leg of a machine as built.

    Args:
        machine: the machine as drawn.
        built: the places of its legs as built, at the home pose of the file.
        notes: lines of comment at its head.
    """
    document = document_of(machine, built)
    left_out = _limits_lost(document_of(machine).get("limits", {}), document)
    if left_out:
        notes = [*notes, f"Left out, since axes of joints do not meet: {left_out}; travels stand for lengths of legs."]
    return "".join(f"# {note}\n" for note in notes) + _text(document, machine)


def fitted_text(answer: Identification) -> str | None:
    """Return the text of a machine file of a machine as measurements say it is built.

    Where the numbers of the machine's own file say all that was found, it is that file with these numbers as
    identified; comments, units and names stay. Otherwise it is a file leg by leg.

    Args:
        answer: the answer of `identify`.

    Returns:
        The text; None where legs with these errors close only by being bent.
    """
    if machine := identified_machine(answer):
        return as_file(machine)
    try:
        built = as_built(answer.machine, answer.errors)
    except InputError:
        return None
    notes = [
        f"{answer.machine.name} as built, from {answer.observed.data.path}.",
        "Zeros and gains of actuators are in the record of the fit; coordinates here are the real ones.",
    ]
    return built_text(answer.machine, built.configuration, notes)


def document_of(machine: Machine, built: Configuration | None = None) -> Document:
    """Return a machine as what its file leg by leg would say.

    Args:
        machine: the machine whose tables the file takes over.
        built: the places of its legs; at the machine's pose if None.

    Raises:
        InputError: it cannot be placed at its pose.
    """
    configuration = built or state_of(machine).configuration
    if not all(np.isfinite(_numbers(point)).all() for leg in configuration.legs for point in leg.path):
        raise InputError(f"{machine.name} cannot be placed at its pose; change [pose] until `kinetostat check` is ok.")
    turn, point = configuration.platform.rotation, configuration.platform.translation
    document: Document = {"schema": SCHEMA_VERSION, "name": machine.name, "family": NAME}
    document |= {"space": "planar"} if machine.family.planar else {}
    document |= {"platform": {"point": _numbers(point)}, "pose": _pose(configuration, point)}
    document["legs"] = [_LegEntry(leg, point).document() for leg in configuration.legs]
    tables = {"tool": _tool(machine, turn)}
    tables |= {name: _changed_entries(machine, name) for name in ("drives", "servo", "damping", "cutting")}
    tables |= {"load": _load(machine, turn), "limits": _limits(machine, turn, built)}
    return document | {name: table for name, table in tables.items() if table}


def _changed_entries(machine: Machine, name: str) -> Document:
    """Return the entries of a common table that are not the usual ones, and those of single drives."""
    usual = vars(COMMON_TABLES[name]())
    entries = {field: value for field, value in vars(machine.tables[name]).items() if value != usual[field]}
    single = [table for table in machine.family.own_drives if table.of_all == name]
    return entries | {table.drive: dict(vars(machine.tables[table.path])) for table in single}


def _limits(machine: Machine, turn: Rotation, built: Configuration | None) -> dict[str, float]:
    """Return the limits that the file leg by leg can say, SI."""
    table = machine.tables["limits"]
    limits = {limit.name: getattr(table, limit.name) for limit in limits_set(table)}
    if _numbers(turn.z) != [0.0, 0.0, 1.0]:  # the platform's z axis is that of the base at the home pose of such a file
        limits.pop("platform_joint_angle", None)
    if built:
        limits = _limits_as_built(limits, machine, built)
    return limits | {name: getattr(table, name) for name in OF_DRIVES if is_set(getattr(table, name))}


def _limits_as_built(limits: dict[str, float], machine: Machine, built: Configuration) -> dict[str, float]:
    """Return limits of a machine whose axes of joints no longer meet: lengths of such legs become travels of rams.

    Args:
        limits: the limits of the machine as drawn, SI.
        machine: the machine as drawn.
        built: the places of its legs as built, at the home pose.
    """
    parted = [leg.name for leg in built.legs if _is_parted(leg)]
    drawn = [rod for rod in rods(state_of(machine).configuration.legs) if rod.telescopic and rod.leg in parted]
    rams = [(rod.leg, 0.0) for rod in drawn]
    rams += [(leg.name, 0.0) for leg in built.legs for _ in driven_slides(leg.chain)]
    all_parts = unloaded_parts(built.legs, built.platform.rotation.z, machine.family.planar, rams)
    whole_legs = replace(all_parts, legs=[leg for leg in built.legs if leg.name not in parted])
    result = {name: limit for name, limit in limits.items() if any(True for _ in LIMITS[name].measure(whole_legs))}
    lengths = [float(rod.length) for rod in drawn]
    if lengths and "shortest_leg" in limits:
        result["travel_from"] = max(limits["shortest_leg"] - min(lengths), limits.get("travel_from", -math.inf))
    if lengths and "longest_leg" in limits:
        result["travel_to"] = min(limits["longest_leg"] - max(lengths), limits.get("travel_to", math.inf))
    return result


def _is_parted(leg: Leg) -> bool:
    """Return whether the axes of a joint with several of them do not meet in a point."""
    points: dict[str, set[Vector]] = {}
    for element in leg.chain:
        for joint in element.freedoms:
            if joint.point is not None:
                points.setdefault(joint.name, set()).add(joint.point)
    return any(len(places) > 1 for places in points.values())


def _tool(machine: Machine, turn: Rotation) -> dict[str, Any]:
    """Return the table [tool]; platform axes are those of the base at the home pose of a file leg by leg."""
    table = machine.tables["tool"]
    entries: dict[str, Any] = {name: getattr(table, name) for name in quantities(Tool)}
    for name, value in entries.items():
        if name.endswith("inertia"):
            entries[name] = [float(entry) for entry in turned_tensor(turn.apply, value)]
        elif isinstance(value, tuple):
            entries[name] = _numbers(turn.apply(Vector(*value)))
    return {name: value for name, value in entries.items() if np.any(value)}


def _load(machine: Machine, turn: Rotation) -> dict[str, Any]:
    """Return the table [load], with the loads that have names."""
    table, usual = machine.tables["load"], Load()
    entries = {name: getattr(table, name) for name in quantities(Load) if getattr(table, name) != getattr(usual, name)}
    entries = {name: list(value) if isinstance(value, tuple) else value for name, value in entries.items()}
    entries |= {"state": machine.state} if machine.loaded else {}
    for name in machine.family.loads:
        entry = machine.tables[f"load.{name}"]
        point = _numbers(turn.apply(Vector(*entry.point)))
        entries[name] = {"point": point, "moment": list(entry.moment), "force": list(entry.force)}
    return entries


def _pose(configuration: Configuration, point: Vector) -> dict[str, float]:
    names = [SPATIAL_POSE[number] for number in task_coordinates(configuration, point)]
    home = dict(zip("xyz", _numbers(point), strict=True))
    return {name: home.get(name, 0.0) for name in names}


@dataclass
class _LegEntry:
    """The joints and links of one leg while they are written.

    Attributes:
        leg: the leg.
        tip: the point of the platform.
        joints, links: entries of the file so far.
        pending: springs that deflect since the last joint and are not written yet.
    """

    leg: Leg
    tip: Vector
    joints: list[dict[str, Any]] = field(default_factory=list)
    links: dict[str, Any] = field(default_factory=dict)
    pending: list[Spring] = field(default_factory=list)

    def document(self) -> dict[str, Any]:
        """Return the leg as its entry in the file."""
        elements = list(_free_where_zero(self.leg.chain))
        for (is_joint, _), run in groupby(elements, key=_place_of_joint):
            row = list(run)
            if is_joint:
                self._add_joints_at_point([element for element in row if isinstance(element, Joint)])
            else:
                self._add_elements(row)
        if self.pending:
            self._add_joint({"name": "flange", "type": "fixed", "point": _numbers(self.tip)})
        self.joints[-1]["joins"] = [self.joints[-1]["joins"][0], PLATFORM]
        _with_universal(self.joints)
        links = {"links": self.links} if self.links else {}
        return {"name": str(self.leg.name), "joints": self.joints, **links}

    def _add_elements(self, row: Sequence[Element]) -> None:
        """Add elements between joints: drives and hinges become joints, all else waits for the next joint."""
        series: list[Spring] = []  # springs of one drive, one behind the other
        for element in row:
            if isinstance(element, Spring) and series and _same_freedom(series[0].joint, element.joint):
                series.append(element)
                self.joints[-1]["stiffness"] = [f"{self._name(s.name)} {_stiffness(s)}" for s in series]
            elif isinstance(element, Spring) and (element.actuated or element.hinge):
                series = [element]
                entries: dict[str, Any] = {"actuated": True} if element.actuated else {}
                entries |= {"preload": float(element.preload)} if element.preload else {}
                entries |= {"acts": element.acts} if element.acts else {}
                entries |= {"stiffness": _stiffness(element)}
                self._add_joint({**self._freedom(element.joint), **entries}, element.part_name)
            elif isinstance(element, Parallelogram):
                self._add_joint(_parallelogram(element), element.name)
            else:
                self.pending += [spring for spring in element.springs if spring.stiffness != RIGID]

    def _add_joints_at_point(self, joints: Sequence[Joint]) -> None:
        """Add joints that share a point, or have none: two hinges are a universal joint, three a spherical one."""
        first = joints[0]
        if first.point is not None and len(joints) in (2, 3) and not any(joint.pitch for joint in joints):
            table: dict[str, Any] = {"type": "spherical", "point": _numbers(first.point)}
            if len(joints) == 2:
                table |= {"type": "universal", "first_axis": _numbers(first.axis)}
                table |= {"second_axis": _numbers(joints[1].axis)}
            self._add_joint(table, first.name)
            return
        for joint in joints:
            self._add_joint(self._freedom(joint), joint.name)

    def _freedom(self, joint: Joint) -> dict[str, Any]:
        """Return the entries of a joint with one freedom."""
        axis = {"axis": _numbers(joint.axis)}
        if joint.point is None:
            point = _numbers(joint.carriage) if joint.carriage is not None else self._place_of_slide()
            return {"type": "prismatic", "point": point, **axis}
        pitch = {"pitch": float(joint.pitch)} if joint.pitch else {}
        return {"type": "helical" if pitch else "revolute", "point": _numbers(joint.point), **axis, **pitch}

    def _place_of_slide(self) -> list[float]:
        """Return a point for a slide that has none: that of the joint before it."""
        return list(self.joints[-1]["point"]) if self.joints else _numbers(next(iter(self.leg.path), self.tip))

    def _add_joint(self, joint: dict[str, Any], title: str = "") -> None:
        """Add a joint, and before it what deflects since the last one: as its seat, or as the link that it ends.

        Args:
            joint: its entries; a name among them is only a wish.
            title: the name of the part, if its entries have none.
        """
        name = self._free_name(joint.pop("name", "") or self._name(title) or joint["type"])
        bodies = (self.joints[-1]["joins"][1] if self.joints else BASE), f"body {len(self.joints) + 1}"
        compliance = compliance_at(self.pending, Vector(*joint["point"])).tolist() if self.pending else []
        if compliance and self.joints:
            body = self._free_name(self._name(self.pending[0].part_name))
            self.joints[-1]["joins"] = [self.joints[-1]["joins"][0], body]
            bodies = body, bodies[1]
            self.links[body] = {"model": "matrix", "compliance": compliance}
        elif compliance:
            joint["compliance"] = compliance
        self.pending = []
        kind, point = joint.pop("type"), joint.pop("point")
        self.joints.append({"name": name, "type": kind, "joins": list(bodies), "point": point, **joint})

    def _name(self, title: str) -> str:
        """Return the name of a part without that of its leg and without dots."""
        title = title.kind if isinstance(title, PartName) else title.removeprefix(f"{self.leg.name} ")
        return title.replace(".", " ").strip()[:LONGEST_NEW_NAME]

    def _free_name(self, name: str) -> str:
        used = {joint["name"] for joint in self.joints} | self.links.keys()
        numbered = (f"{name} {number}" for number in count(2))
        return name if name not in used else next(other for other in numbered if other not in used)


def _place_of_joint(element: Element) -> tuple[bool, Vector | None]:
    """Return whether an element is a joint, and its point: hinges about one point are written as one joint."""
    return (True, element.point) if isinstance(element, Joint) else (False, None)


def _free_where_zero(chain: Iterable[Element]) -> Iterable[Element]:
    """Give the chain with a joint in the place of each spring that is free and not an actuator."""
    for element in chain:
        free = isinstance(element, Spring) and not element.actuated and element.stiffness == 0.0
        yield element.joint if free else element  # type: ignore[attr-defined]


def _same_freedom(first: Joint, second: Joint) -> bool:
    return (first.axis, first.point, first.pitch) == (second.axis, second.point, second.pitch)


def _with_universal(joints: list[dict[str, Any]]) -> None:
    """Make the first of two ball joints with a strut between them universal, so that the strut cannot spin."""
    balls = [i for i, joint in enumerate(joints) if joint["type"] == "spherical"]
    for first, second in pairwise(balls):
        if all(joint["type"] == "prismatic" for joint in joints[first + 1 : second]):
            joints[first] |= {"type": "universal", "axis": joints[second]["name"]}


def _parallelogram(element: Parallelogram) -> dict[str, Any]:
    ends = {"point": _numbers(element.near), "far": _numbers(element.far), "axis": _numbers(element.side)}
    bar = {} if element.bar == RIGID else {"bar_stiffness": float(element.bar)}
    return {"type": "parallelogram", **ends, "width": float(element.width), **bar}


def compliance_at(springs: Sequence[Spring], point: Vector) -> Array:
    """Return the sum of what springs between two bodies deflect at a point [6 x 6], base axes, rx ry rz x y z, SI.

    A file gives 0 where a link is rigid, and so it is where a spring's twist is only round-off, or less than a file may
    say.
    """
    twists = [clean_screw(spring.joint.twist(point), 1.0).components() for spring in springs]
    whole = sum((np.outer(t, t) / s.stiffness for t, s in zip(twists, springs, strict=True)), np.zeros((6, 6)))
    deflects = np.diag(whole) >= 1.0 / LARGEST_OTHER
    return np.asarray(np.where(np.outer(deflects, deflects), whole, 0.0))


def _stiffness(spring: Spring) -> str:
    unit = "N/m" if spring.joint.point is None else "N*m/rad"
    return "rigid" if spring.stiffness == RIGID else f"{float(spring.stiffness)!r} {unit}"


def _numbers(vector: Vector) -> list[float]:
    return [float(c) + 0.0 for c in vector.components()]


def _text(document: Document, machine: Machine) -> str:
    """Return the document as a file that people can read: a line for each joint."""
    lines = [
        f"# {machine.name}, leg by leg at the pose of its file, which is the home pose here. Numbers are in SI.",
        "# Links as a 6x6 are those of this pose; masses of links are not carried over.",
    ]
    lines += [f"{key} = {toml_value(value)}" for key, value in document.items() if not isinstance(value, dict | list)]
    for key, table in document.items():
        if isinstance(table, dict):
            lines += ["", f"[{key}]", *toml_pairs(table)]
    for leg in document["legs"]:
        lines += ["", "[[legs]]", f"name = {toml_value(leg['name'])}", "joints = ["]
        lines += [f"  {toml_value(joint)}," for joint in leg["joints"]] + ["]"]
        lines += [f"links.{toml_key(name)} = {toml_value(link)}" for name, link in leg.get("links", {}).items()]
    return "\n".join(lines) + "\n"
