"""A URDF file with its loops as a machine written leg by leg; its home pose is that of zero joint coordinates.

Legs are the paths from the base to the platform, one of them in the tree and the others through loops. Hinges about one
point become one joint of the leg; links that are fixed together are one body with the mass of all. Reading the file
itself is the business of `urdf_file`.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from kinetostat.arrays import Array
from kinetostat.exchange.formats import one_line
from kinetostat.exchange.urdf_export import MIMIC_RATIO, TIP
from kinetostat.exchange.urdf_file import FileJoint, FileLoop, UrdfFile, numbers, read
from kinetostat.kinematics.mobility import task_coordinates
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.machine.written.plan import BASE, NAME, PLANAR_POSE, PLATFORM, SPATIAL_POSE
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.validation import LONGEST_MACHINE_NAME, SCHEMA_VERSION
from kinetostat.tolerances import COINCIDENT_HINGES, INDEPENDENT_AXES, OPEN_LOOP
from kinetostat.units import RIGID
from kinetostat.validation.pieces import one_body, tensor_of

CLOSING = ("fixed", "revolute", "continuous", "prismatic", "spherical")
"""Kinds of joints that may close a loop."""
ONE_FREEDOM = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
"""Kinds of URDF joints with one freedom, and what they are called in a machine file."""
LONGEST_PART_NAME = 40
"""Characters of the name of a leg or a joint: messages and tables have room for it."""


def read_machine(path: Path) -> tuple[Machine, list[str]]:
    """Return the machine of a URDF file at its home pose, and the names of the links whose masses it does not have.

    Raises:
        InputError: the file lacks something, or is not a machine of legs between a base and a platform.
    """
    file = read(path)
    bodies = Bodies(file)
    document = document_of(file, bodies)
    machine = build(document, file.origin)
    home = machine.configure([0.0] * machine.chains().size)
    free = [SPATIAL_POSE[number] for number in task_coordinates(home, home.platform.translation)] or ["x"]
    posed = build({**document, "pose": {name: document["pose"][name] for name in free}}, file.origin)
    return posed, sorted(bodies.uncounted)


def machine_text(path: Path) -> str:
    """Return the text of a machine file that describes the machine of a URDF file.

    Raises:
        InputError: as `read_machine`.
    """
    machine, uncounted = read_machine(path)
    names = shorten(", ".join(uncounted))
    note = f"# Masses of links between the base and the platform only; not counted: {names}.\n" if uncounted else ""
    return (
        f"# Read from {path.name}. The home pose is the one of zero joint coordinates; actuators of which the URDF\n"
        f"# gives no stiffness are rigid here.\n{note}{as_file(machine)}"
    )


class Bodies:
    """The heavy bodies of a file: links that fixed joints hold together are one body.

    Attributes:
        uncounted: names of the links with a mass that no table has yet; those of the base do not count.
    """

    def __init__(self, file: UrdfFile) -> None:
        self._masses = file.masses
        self._parts: dict[str, list[str]] = {}
        self._body = {file.root: file.root}  # the first link of the body that a link belongs to
        for link in file.frames:  # from the root outwards
            joint = file.joints.get(link)
            if joint is not None:
                fixed = joint.kind == "fixed" and not joint.extension
                self._body[link] = self._body[joint.parent] if fixed else link
        for link in file.masses:
            self._parts.setdefault(self._body[link], []).append(link)
        self.uncounted = {link for link in file.masses if self._body[link] != file.root}

    def links(self, link: str) -> list[str]:
        """Return the links with a mass in the body of a link."""
        return self._parts.get(self._body[link], [])

    def table(self, links: Iterable[str]) -> Document:
        """Join some links into one mass with its centre and inertia, in the root link's frame; empty without a mass.

        These links are no longer in `uncounted`, so that no mass counts twice.
        """
        names = {name for link in links for name in self.links(link)} & self.uncounted
        self.uncounted -= names
        if not names:
            return {}
        whole = one_body([self._masses[name] for name in sorted(names)])
        inertia = list(tensor_of(whole.inertia))
        return {"mass": whole.mass, "centre_of_mass": whole.centre.tolist(), "inertia": inertia}


def document_of(file: UrdfFile, bodies: Bodies | None = None) -> Document:
    """Return the machine as a document with all coordinates of its pose.

    Args:
        file: the file that was read.
        bodies: its bodies, from which what the machine weighs is taken.

    Raises:
        InputError: if the file is not legs between the root link and a platform.
    """
    space = choice(file.extension.get("space", "spatial"), ("spatial", "planar"), f'"{file.origin}": space')
    platform = _platform_of(file)
    rigid = _rigid_with(file, platform)
    legs = [_path(file, platform), *(_path(file, _tip(file, loop, rigid)) for loop in file.loops)]
    _check_apart(file, legs)
    bodies = bodies or Bodies(file)
    welded = [path[-1].child for path, loop in zip(legs[1:], file.loops, strict=True) if path and loop.kind == "fixed"]
    tool = bodies.table([platform, *welded])
    point = file.frames[platform][:3, 3]
    if tool:
        tool["centre_of_mass"] = (np.array(tool["centre_of_mass"]) - point).tolist()
    end = file.extension.get("tool", "tool")
    if end in file.frames:
        tool["offset"] = _tool_offset(file, end, rigid, point)
    coordinates = PLANAR_POSE if space == "planar" else SPATIAL_POSE
    document: Document = {
        "schema": SCHEMA_VERSION,
        "name": one_line(file.name)[:LONGEST_MACHINE_NAME],
        "family": NAME,
        "space": space,
        "pose": {name: float(point["xyz".index(name)]) if name in "xyz" else 0.0 for name in coordinates},
        "platform": {"point": point.tolist()},
        "legs": [
            _leg(_leg_name(path, number), path, loop, bodies, file.origin)
            for number, (path, loop) in enumerate(zip(legs, [None, *file.loops], strict=True), 1)
        ],
    }
    return document | ({"tool": tool} if tool else {})


def _platform_of(file: UrdfFile) -> str:
    """Return the link that is the platform: the one of that name, or the one that the file names."""
    platform = file.extension.get("platform", PLATFORM)
    if platform not in file.frames or platform == file.root:
        raise InputError(
            f'"{file.origin}": no link is called {shorten(platform)}; give the platform that name, or name it with '
            '<kinetostat platform="..."/> in <robot>.'
        )
    return platform


def _tool_offset(file: UrdfFile, tool: str, rigid: set[str], point: Array) -> list[float]:
    """Return the place of the tool as seen from the platform point, m, base axes."""
    if tool not in rigid:
        raise InputError(f'"{file.origin}": link {shorten(tool)}, the tool, must be fixed to the platform.')
    return [float(c) for c in file.frames[tool][:3, 3] - point]


def _path(file: UrdfFile, link: str) -> list[FileJoint]:
    """Return the joints from the root to a link."""
    path = []
    while link != file.root:
        path.append(file.joints[link])
        link = file.joints[link].parent
    return path[::-1]


def _rigid_with(file: UrdfFile, platform: str) -> set[str]:
    """Return the links that are fixed to the platform, itself among them."""
    fixed = [joint for joint in file.joints.values() if joint.kind == "fixed" and not joint.extension]
    pairs = [{joint.parent, joint.child} for joint in fixed]
    links: set[str] = set()
    neighbours = {platform}
    while neighbours != links:
        links = neighbours
        neighbours = links.union(*(pair for pair in pairs if pair & links))
    return links


def _tip(file: UrdfFile, loop: FileLoop, rigid: set[str]) -> str:
    """Return the link at the end of the leg that a loop holds to the platform."""
    where = f'"{file.origin}": loop {shorten(loop.name)}'
    tips = [link for link in loop.links if link not in rigid]
    if len(tips) != 1:
        raise InputError(
            f"{where} must close a leg onto the platform; a loop within a leg can only be a parallelogram, written as "
            'two revolutes, the second with <mimic multiplier="-1"/>.'
        )
    if loop.kind not in CLOSING:
        raise InputError(f"{where} is of type {shorten(loop.kind)}; its type may be {', '.join(CLOSING)}.")
    if tips[0] == file.root and loop.kind == "fixed":
        raise InputError(
            f"{where} fixes the platform to {shorten(file.root)}, the base, so that nothing moves; leave it out."
        )
    first, second = loop.frames
    gap = float(np.linalg.norm(first[:3, 3] - second[:3, 3]))
    angle = float(np.linalg.norm(first[:3, :3] - second[:3, :3])) if loop.kind == "fixed" else 0.0
    if gap > OPEN_LOOP or angle > OPEN_LOOP:
        raise InputError(
            f"{where} is open by {gap:.3g} m and {angle:.3g} rad at zero joint coordinates; write the file at a pose "
            "in which its loops close."
        )
    return tips[0]


def _check_apart(file: UrdfFile, paths: Sequence[Sequence[FileJoint]]) -> None:
    """Refuse joints that move and that two legs share."""
    of_other_legs: set[str] = set()
    for path in paths:
        names = {joint.name for joint in path if joint.kind != "fixed" or joint.extension}
        if shared := names & of_other_legs:
            raise InputError(
                f'"{file.origin}": joint {shorten(min(shared))} belongs to two legs; legs may share the base and the '
                "platform only."
            )
        of_other_legs |= names


def _leg_name(path: Sequence[FileJoint], number: int) -> str:
    """Return the name that `urdf_export` gave the tip of a leg, or the number of the leg."""
    links = [joint.child for joint in path if joint.child.endswith(TIP)]
    return links[-1].removesuffix(TIP).replace(".", "-")[:LONGEST_PART_NAME] if links else f"leg {number}"


def _leg(leg: str, path: Sequence[FileJoint], loop: FileLoop | None, bodies: Bodies, origin: str) -> Document:
    """Return a leg from base to platform, as a machine file lists its joints and the links that weigh something.

    Args:
        leg: its name, which is taken off the names of joints.
        path: the joints from the root to the platform, or to the tip of the leg.
        loop: the joint between the tip and the platform, if it closes a loop.
        bodies: the bodies of the file.
        origin: name of the file, for messages.

    Raises:
        InputError: a kind of joint that a leg cannot have.
    """
    row = [joint for joint in path if joint.kind != "fixed" or "compliance" in joint.extension]
    if loop is not None and loop.kind != "fixed":
        row.append(_as_joint(loop))
    tables: list[Document] = []
    links: Document = {}
    while row:
        where = f'"{origin}": joint {shorten(row[0].name)}'
        count, table = _first_joint(row, bodies, where)
        tables.append({"name": _name(row[0].name, leg), "point": row[0].frame[:3, 3].tolist(), **table})
        body, row = row[count - 1].child, row[count:]
        mass = bodies.table([body]) if row else {}
        links |= {f"body {len(tables)}": {"model": "rigid", **mass}} if mass else {}
    if not tables:
        tables = [{"name": "foot", "point": path[-1].frame[:3, 3].tolist(), "type": "fixed"}]
    names = [BASE, *(f"body {i}" for i in range(1, len(tables))), PLATFORM]
    for table, near, far in zip(tables, names, names[1:], strict=False):
        table["joins"] = [near, far]
    return {"name": leg, "joints": tables} | ({"links": links} if links else {})


def _as_joint(loop: FileLoop) -> FileJoint:
    """Return the joint that closes a loop, as the last one of its leg."""
    parent, child = loop.links
    return FileJoint(
        name=loop.name,
        kind=loop.kind,
        parent=parent,
        child=child,
        frame=loop.frames[0],
        axis=loop.axis,
        actuated=False,
        mimics=None,
        extension={},
    )


def _name(text: str, leg: str) -> str:
    """Return a name as a machine file takes it."""
    return text.removeprefix(f"{leg}_").replace(".", "-")[:LONGEST_PART_NAME]


def _first_joint(row: Sequence[FileJoint], bodies: Bodies, where: str) -> tuple[int, Document]:
    """Return the number of the first joints of a row that make one joint of a leg, and the table of that joint."""
    first = row[0]
    if len(row) > 1 and row[1].mimics is not None:
        return 2, _parallelogram(first, row[1], where)
    if first.mimics is not None:
        raise InputError(f"{where} mimics {shorten(first.mimics[0])}; it may mimic only the joint before it.")
    if first.kind == "fixed":
        return 1, {"type": "fixed", "compliance": _compliance(first, where)}
    if first.kind == "spherical":
        return 1, {"type": "spherical"}
    if first.kind not in ONE_FREEDOM:
        kinds = ", ".join(ONE_FREEDOM)
        raise InputError(f"{where} is of type {shorten(first.kind)}; a leg may have {kinds} and fixed joints.")
    hinges = _hinges(row, bodies)
    if hinges > 1:
        axes = [joint.axis.tolist() for joint in row[:hinges]]
        universal = {"type": "universal", "first_axis": axes[0], "second_axis": axes[1]}
        return hinges, {"type": "spherical"} if hinges == 3 else universal
    return 1, _single(first)


def _hinges(row: Sequence[FileJoint], bodies: Bodies) -> int:
    """Return the number of the first joints that are free hinges about one point with independent axes: 1, 2 or 3.

    Hinges with something heavy between them stay apart, since a joint of a leg has no bodies inside.
    """
    for count in (3, 2):
        hinges = row[:count]
        free = [
            j for j in hinges if j.kind in ("revolute", "continuous") and not (j.actuated or j.extension or j.mimics)
        ]
        if len(free) < count or (len(row) > count and row[count].mimics is not None):
            continue
        if any(bodies.links(joint.child) for joint in hinges[:-1]):
            continue
        distance = max(float(np.linalg.norm(joint.frame[:3, 3] - hinges[0].frame[:3, 3])) for joint in hinges)
        spanned = np.linalg.svd(np.array([joint.axis for joint in hinges]), compute_uv=False).min()
        if distance < COINCIDENT_HINGES and spanned > INDEPENDENT_AXES:
            return count
    return 1


def _single(joint: FileJoint) -> Document:
    """Return a joint with one freedom; an actuator without a stiffness is rigid."""
    table: Document = {"type": ONE_FREEDOM[joint.kind], "axis": joint.axis.tolist()}
    if "pitch" in joint.extension:
        table |= {"type": "helical", "pitch": _number(joint, "pitch")}
    if joint.actuated:
        table["actuated"] = True
    if joint.actuated or "stiffness" in joint.extension:
        table["stiffness"] = _stiffness(joint, "stiffness")
    return table


def _parallelogram(near: FileJoint, far: FileJoint, where: str) -> Document:
    """Return two revolutes of which the second turns back what the first turned."""
    turns_back = far.mimics == (near.name, MIMIC_RATIO)
    if not turns_back or float(np.linalg.norm(np.cross(near.axis, far.axis))) > INDEPENDENT_AXES:
        raise InputError(
            f"{where} is followed by {shorten(far.name)}; a joint may only mimic the one before it, with the same axis "
            "and multiplier -1: a parallelogram."
        )
    span = far.frame[:3, 3] - near.frame[:3, 3]
    side = np.cross(near.axis, span)
    if "parallelogram" in far.extension:
        side = far.frame[:3, :3] @ np.array(numbers(far.extension["parallelogram"], 3, f"{where}: parallelogram"))
    return {
        "type": "parallelogram",
        "far": far.frame[:3, 3].tolist(),
        "axis": side.tolist(),
        "width": _number(far, "width") if "width" in far.extension else 1.0,
        "bar_stiffness": _stiffness(far, "bar_stiffness"),
    }


def _compliance(joint: FileJoint, where: str) -> list[list[float]]:
    """Return the 6x6 of a fixed joint, turned from the axes of the joint to those of the base."""
    entries = np.array(numbers(joint.extension["compliance"], 36, f"{where}: compliance")).reshape(6, 6)
    turn = np.kron(np.eye(2), joint.frame[:3, :3])
    compliance: Array = turn @ entries @ turn.T
    return [list(row) for row in ((compliance + compliance.T) / 2.0).tolist()]


def _stiffness(joint: FileJoint, key: str) -> float | str:
    return RIGID if joint.extension.get(key, RIGID) == RIGID else _number(joint, key)


def _number(joint: FileJoint, key: str) -> float:
    return numbers(joint.extension[key], 1, f"joint {shorten(joint.name)}: {key}")[0]
