"""A row of URDF joints as the joints of a leg in a machine file: hinges about one point become one joint.

How legs, loops and the platform are found is `urdf_machine`'s business.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.exchange.urdf_file import Array, FileJoint, FileLoop, numbers
from kinetostat.exchange.urdf_joints import OPPOSITE
from kinetostat.machine.written.plan import BASE, PLATFORM
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.units import RIGID

SAME_POINT = 1e-9
"""Distance of two hinges, m, below which they are one joint."""
INDEPENDENT = 1e-6
"""Volume or area that unit axes span, below which one of them depends on the others."""
ONE_FREEDOM = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
"""Kinds of URDF joints with one freedom, and what they are called in a machine file."""
LONGEST_NAME = 40


def leg_joints(leg: str, path: Sequence[FileJoint], loop: FileLoop | None, origin: str) -> list[Document]:
    """The joints of a leg from base to platform, as a machine file lists them.

    Args:
        leg: its name, which names of joints need not repeat.
        path: the joints from the root to the platform, or to the tip of the leg.
        loop: what holds the tip to the platform, if anything does.
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
    """What the first joints of a row are together: how many of them, and their table."""
    first = row[0]
    if len(row) > 1 and row[1].mimics is not None:
        return 2, _parallelogram(first, row[1], where)
    if first.mimics is not None:
        raise InputError(f"{where} follows {shorten(first.mimics[0])}; it may follow the joint before it, or none.")
    if first.kind == "fixed":
        return 1, {"type": "fixed", "compliance": _compliance(first, where)}
    if first.kind == "spherical":
        return 1, {"type": "spherical"}
    if first.kind not in ONE_FREEDOM:
        kinds = ", ".join(ONE_FREEDOM)
        raise InputError(f"{where} is {shorten(first.kind)}; a leg may have {kinds} and fixed joints.")
    hinges = _hinges(row)
    if hinges > 1:
        axes = [joint.axis.tolist() for joint in row[:hinges]]
        universal = {"type": "universal", "first_axis": axes[0], "second_axis": axes[1]}
        return hinges, {"type": "spherical"} if hinges == 3 else universal
    return 1, _single(first)


def _hinges(row: Sequence[FileJoint]) -> int:
    """How many of the first joints are free hinges about one point and no two of them the same: 1, 2 or 3."""
    for count in (3, 2):
        held = row[:count]
        free = [j for j in held if j.kind in ("revolute", "continuous") and not (j.actuated or j.extension or j.mimics)]
        if len(free) < count or (len(row) > count and row[count].mimics is not None):
            continue
        apart = max(float(np.linalg.norm(joint.frame[:3, 3] - held[0].frame[:3, 3])) for joint in held)
        spanned = np.linalg.svd(np.array([joint.axis for joint in held]), compute_uv=False).min()
        if apart < SAME_POINT and spanned > INDEPENDENT:
            return count
    return 1


def _single(joint: FileJoint) -> Document:
    """A joint with one freedom; an actuator of which no stiffness is said is rigid."""
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
    if not together or float(np.linalg.norm(np.cross(near.axis, far.axis))) > INDEPENDENT:
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
    """The 6x6 of a fixed joint, from its own axes to those of the base."""
    entries = np.array(numbers(joint.extension["compliance"], 36, f"{where}: compliance")).reshape(6, 6)
    turn = np.kron(np.eye(2), joint.frame[:3, :3])
    turned: Array = turn @ entries @ turn.T
    return [list(row) for row in ((turned + turned.T) / 2.0).tolist()]


def _stiffness(joint: FileJoint, key: str) -> float | str:
    return RIGID if joint.extension.get(key, RIGID) == RIGID else _number(joint, key)


def _number(joint: FileJoint, key: str) -> float:
    return numbers(joint.extension[key], 1, f"joint {shorten(joint.name)}: {key}")[0]
