"""A URDF file with its loops as a machine written leg by leg; its home pose is that of zero joint coordinates.

Legs are the paths from the base to the platform, one of them in the tree and the others through loops. Hinges about one
point become one joint of the leg. Reading the file itself is the business of `urdf_file`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kinetostat.exchange.formats import one_line
from kinetostat.exchange.urdf_export import OPPOSITE, TIP
from kinetostat.exchange.urdf_file import Array, FileJoint, FileLoop, UrdfFile, numbers, read
from kinetostat.kinematics.mobility import task_coordinates
from kinetostat.machine.loading import build
from kinetostat.machine.machine import Machine
from kinetostat.machine.saving import as_file
from kinetostat.machine.written.plan import BASE, NAME, PLANAR_POSE, PLATFORM, SPATIAL_POSE
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.validation import SCHEMA_VERSION
from kinetostat.tolerances import COINCIDENT_HINGES, INDEPENDENT_AXES, OPEN_LOOP
from kinetostat.units import RIGID

CLOSING = ("fixed", "revolute", "continuous", "prismatic", "spherical")
"""Kinds of joints that may close a loop."""
ONE_FREEDOM = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
"""Kinds of URDF joints with one freedom, and what they are called in a machine file."""
LONGEST_NAME = 40


def read_machine(path: Path) -> Machine:
    """Return the machine of a URDF file, at its home pose.

    Raises:
        InputError: the file lacks something, or is not a machine of legs between a base and a platform.
    """
    file = read(path)
    document = document_of(file)
    machine = build(document, file.origin)
    home = machine.configure([0.0] * machine.chains().size)
    free = [SPATIAL_POSE[number] for number in task_coordinates(home, home.platform.translation)] or ["x"]
    return build({**document, "pose": {name: document["pose"][name] for name in free}}, file.origin)


def machine_text(path: Path) -> str:
    """Return the text of a machine file that describes the machine of a URDF file.

    Raises:
        InputError: as `read_machine`.
    """
    return (
        f"# Read from {path.name}. The home pose is the one of zero joint coordinates; actuators of which the URDF\n"
        f"# gives no stiffness are rigid here.\n{as_file(read_machine(path))}"
    )


def document_of(file: UrdfFile) -> Document:
    """Return the machine as a document with all coordinates of its pose.

    Raises:
        InputError: if the file is not legs between the root link and a platform.
    """
    space = choice(file.about.get("space", "spatial"), ("spatial", "planar"), f'"{file.origin}": space')
    platform = file.about.get("platform", PLATFORM)
    if platform not in file.frames or platform == file.root:
        raise InputError(
            f'"{file.origin}": no link is called {shorten(platform)}; give the platform that name, or name it with '
            '<kinetostat platform="..."/> in <robot>.'
        )
    rigid = _rigid_with(file, platform)
    ways = [(_path(file, platform), None), *((_path(file, _tip(file, loop, rigid)), loop) for loop in file.loops)]
    _check_apart(file, [path for path, _ in ways])
    names = [_leg_name(path, number) for number, (path, _) in enumerate(ways, 1)]
    legs = [
        {"name": name, "joints": leg_joints(name, path, loop, file.origin)}
        for name, (path, loop) in zip(names, ways, strict=True)
    ]
    point = file.frames[platform][:3, 3]
    given = PLANAR_POSE if space == "planar" else SPATIAL_POSE
    pose = {name: float(point["xyz".index(name)]) if name in "xyz" else 0.0 for name in given}
    document: Document = {
        "schema": SCHEMA_VERSION,
        "name": one_line(file.name)[:80],
        "family": NAME,
        "space": space,
        "pose": pose,
    }
    document |= {"platform": {"point": point.tolist()}, "legs": legs}
    tool = file.about.get("tool", "tool")
    if tool in file.frames:
        document["tool"] = {"offset": _tool(file, tool, rigid, point)}
    return document


def _tool(file: UrdfFile, tool: str, rigid: set[str], point: Array) -> list[float]:
    if tool not in rigid:
        raise InputError(f'"{file.origin}": link {shorten(tool)}, the tool, must be fixed to the platform.')
    return [float(c) for c in file.frames[tool][:3, 3] - point]


def _path(file: UrdfFile, link: str) -> list[FileJoint]:
    """The joints from the root to a link."""
    path = []
    while link != file.root:
        path.append(file.joints[link])
        link = file.joints[link].parent
    return path[::-1]


def _rigid_with(file: UrdfFile, platform: str) -> set[str]:
    """The links that are fixed to the platform, itself among them."""
    links = {platform}
    growing = True
    while growing:
        fixed = [joint for joint in file.joints.values() if joint.kind == "fixed" and not joint.extension]
        pairs = [{joint.parent, joint.child} for joint in fixed]
        larger = links.union(*(pair for pair in pairs if pair & links))
        growing, links = larger != links, larger
    return links


def _tip(file: UrdfFile, loop: FileLoop, rigid: set[str]) -> str:
    """The link at the end of the leg that a loop holds to the platform."""
    where = f'"{file.origin}": loop {shorten(loop.name)}'
    tips = [link for link in loop.links if link not in rigid]
    if len(tips) != 1:
        raise InputError(
            f"{where} must close a leg onto the platform; a loop within a leg can only be a parallelogram, written as "
            'two revolutes, the second with <mimic multiplier="-1"/>.'
        )
    if loop.kind not in CLOSING:
        raise InputError(f"{where} is of type {shorten(loop.kind)}; its type may be {', '.join(CLOSING)}.")
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
    seen: set[str] = set()
    for path in paths:
        names = {joint.name for joint in path if joint.kind != "fixed" or joint.extension}
        if names & seen:
            raise InputError(
                f'"{file.origin}": joint {shorten(min(names & seen))} belongs to two legs; legs may share the base and '
                "the platform only."
            )
        seen |= names


def _leg_name(path: Sequence[FileJoint], number: int) -> str:
    """The name that `urdf_export` gave the tip of a leg, or the number of the leg."""
    links = [joint.child for joint in path if joint.child.endswith(TIP)]
    return links[-1].removesuffix(TIP).replace(".", "-")[:LONGEST_NAME] if links else f"leg {number}"


def leg_joints(leg: str, path: Sequence[FileJoint], loop: FileLoop | None, origin: str) -> list[Document]:
    """Return the joints of a leg from base to platform, as a machine file lists them.

    Args:
        leg: its name, which is taken off the names of joints.
        path: the joints from the root to the platform, or to the tip of the leg.
        loop: the joint between the tip and the platform, if it closes a loop.
        origin: name of the file, for messages.

    Raises:
        InputError: a kind of joint that a leg cannot have.
    """
    row = [joint for joint in path if joint.kind != "fixed" or "compliance" in joint.extension]
    if loop is not None and loop.kind != "fixed":
        row.append(_as_joint(loop))
    tables: list[Document] = []
    at = 0
    while at < len(row):
        where = f'"{origin}": joint {shorten(row[at].name)}'
        count, table = _next(row[at:], where)
        tables.append({"name": _name(row[at].name, leg), "point": row[at].frame[:3, 3].tolist(), **table})
        at += count
    if not tables:
        tables = [{"name": "foot", "point": path[-1].frame[:3, 3].tolist(), "type": "fixed"}]
    bodies = [BASE, *(f"body {i}" for i in range(1, len(tables))), PLATFORM]
    for table, near, far in zip(tables, bodies, bodies[1:], strict=False):
        table["joins"] = [near, far]
    return tables


def _as_joint(loop: FileLoop) -> FileJoint:
    """The joint that closes a loop, as the last one of its leg."""
    return FileJoint(loop.name, loop.kind, *loop.links, loop.frames[0], loop.axis, False, None, {})


def _name(text: str, leg: str) -> str:
    """A name as a machine file takes it."""
    return text.removeprefix(f"{leg}_").replace(".", "-")[:LONGEST_NAME]


def _next(row: Sequence[FileJoint], where: str) -> tuple[int, Document]:
    """How many of the first joints of a row make one joint of a leg, and the table of that joint."""
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
    hinges = _hinges(row)
    if hinges > 1:
        axes = [joint.axis.tolist() for joint in row[:hinges]]
        universal = {"type": "universal", "first_axis": axes[0], "second_axis": axes[1]}
        return hinges, {"type": "spherical"} if hinges == 3 else universal
    return 1, _single(first)


def _hinges(row: Sequence[FileJoint]) -> int:
    """How many of the first joints are free hinges about one point with independent axes: 1, 2 or 3."""
    for count in (3, 2):
        hinges = row[:count]
        free = [
            j for j in hinges if j.kind in ("revolute", "continuous") and not (j.actuated or j.extension or j.mimics)
        ]
        if len(free) < count or (len(row) > count and row[count].mimics is not None):
            continue
        apart = max(float(np.linalg.norm(joint.frame[:3, 3] - hinges[0].frame[:3, 3])) for joint in hinges)
        spanned = np.linalg.svd(np.array([joint.axis for joint in hinges]), compute_uv=False).min()
        if apart < COINCIDENT_HINGES and spanned > INDEPENDENT_AXES:
            return count
    return 1


def _single(joint: FileJoint) -> Document:
    """A joint with one freedom; an actuator without a stiffness is rigid."""
    table: Document = {"type": ONE_FREEDOM[joint.kind], "axis": joint.axis.tolist()}
    if "pitch" in joint.extension:
        table |= {"type": "helical", "pitch": _number(joint, "pitch")}
    if joint.actuated:
        table["actuated"] = True
    if joint.actuated or "stiffness" in joint.extension:
        table["stiffness"] = _stiffness(joint, "stiffness")
    return table


def _parallelogram(near: FileJoint, far: FileJoint, where: str) -> Document:
    """Two revolutes of which the second turns back what the first turned."""
    together = far.mimics == (near.name, OPPOSITE)
    if not together or float(np.linalg.norm(np.cross(near.axis, far.axis))) > INDEPENDENT_AXES:
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
    """The 6x6 of a fixed joint, turned from the axes of the joint to those of the base."""
    entries = np.array(numbers(joint.extension["compliance"], 36, f"{where}: compliance")).reshape(6, 6)
    turn = np.kron(np.eye(2), joint.frame[:3, :3])
    turned: Array = turn @ entries @ turn.T
    return [list(row) for row in ((turned + turned.T) / 2.0).tolist()]


def _stiffness(joint: FileJoint, key: str) -> float | str:
    return RIGID if joint.extension.get(key, RIGID) == RIGID else _number(joint, key)


def _number(joint: FileJoint, key: str) -> float:
    return numbers(joint.extension[key], 1, f"joint {shorten(joint.name)}: {key}")[0]
