"""The file of a machine written leg by leg: lists by name, and a plan apart from the numbers, with messages.

Every message names the leg and the joint. Numbers are checked by `spec`, as in every machine file.
"""

import copy
from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from kinetostat.machine.cross_section import MATERIALS, SHAPES
from kinetostat.machine.series import is_series, parts
from kinetostat.machine.written.checking import check_chain
from kinetostat.machine.written.joints import (
    JOINT_TYPES,
    ONE_FREEDOM,
    SEAT,
    needs_axis,
    stiffness_kind,
    write_directions,
)
from kinetostat.machine.written.plan import (
    BASE,
    CABLE,
    COPY_KEYS,
    LINK_MODELS,
    MOST_LEGS,
    ONE_SIDED,
    PLANAR_POSE,
    PLATFORM,
    SPATIAL_POSE,
    JointPlan,
    LegPlan,
    LinkPlan,
    Matrix,
    Plan,
    copies_in,
    legs_of,
)
from kinetostat.machine.written.struts import AXIAL, check_strut
from kinetostat.machine.written.tables import WEIGHT
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import LARGEST_OTHER, LEAST_STIFFNESS
from kinetostat.tolerances import SYMMETRIC

MOST_JOINTS = 24
"""Joints that a leg may have: more is a mistake, and the equations would take minutes."""

CABLE_KEYS = ("from", "to", "stiffness", "preload")
"""Fields of a cable: its ends, base frame at the home pose, and its winch; the preload may be left out."""

LARGEST_NUMBER = 1e100
"""Size of numbers in a matrix or a direction from which they are a slip: below it, products of three stay finite."""


def by_name(document: Document, origin: str) -> Document:
    """The document with its lists of legs and joints as tables by name, so that paths can lead into them.

    Raises:
        InputError: no legs, no name, or one name twice.
    """
    result = copy.deepcopy(document)
    legs = result.get("legs")
    if isinstance(legs, list):
        result["legs"] = legs = _entries_by_name(legs, f'"{origin}"', "leg")
    by_leg = _checked_legs(legs, origin)
    for name, leg in by_leg.items():
        if "type" in leg:
            by_leg[name] = leg = _cable(leg, f'"{origin}": leg "{name}"', result.get("space") == "planar")
        if "joints" in leg:
            by_leg[name] = _parts_by_name(leg, f'"{origin}": leg "{name}"')
    return with_parts(result, origin)


def _cable(leg: dict[str, Any], where: str, planar: bool) -> dict[str, Any]:
    """The joints of a leg that is written as a cable: two ends, and between them an actuator that only pulls."""
    choice(leg.get("type"), (CABLE,), f"{where}: type")
    for key in sorted(leg.keys() - {"type", *CABLE_KEYS, *COPY_KEYS, "name"}):
        raise InputError(f"{where}: {key} is not known; a cable has {', '.join(CABLE_KEYS)}, and may have copies.")
    missing = [key for key in CABLE_KEYS[:3] if key not in leg]
    if missing:
        raise InputError(f'{where} is a cable without {" and ".join(missing)}; write e.g. from = [0, 0, "2 m"].')
    rest = {key: value for key, value in leg.items() if key not in ("type", *CABLE_KEYS)}
    pulled = {key: leg[key] for key in CABLE_KEYS[2:] if key in leg}
    ends = [{"type": "revolute", "axis": [0, 0, 1]}] * 2
    if not planar:
        ends = [{"type": "universal", "axis": "eye"}, {"type": "spherical"}]
    winch = {"type": "prismatic", "axis": "eye", "actuated": True, "acts": ONE_SIDED[0]}
    joints = {
        "anchor": {**ends[0], "joins": [BASE, "cable"], "point": leg["from"]},
        "winch": {**winch, "joins": ["cable", "end"], "point": leg["from"], **pulled},
        "eye": {**ends[1], "joins": ["end", PLATFORM], "point": leg["to"]},
    }
    return {**rest, "joints": joints}


def _checked_legs(legs: object, origin: str) -> dict[str, Document]:
    """Return the legs, if they are tables by name, whether a file or an override says it."""
    if not isinstance(legs, dict) or not 1 <= len(legs) <= MOST_LEGS:
        given = "" if isinstance(legs, dict | None) else f"legs is {shorten(legs)}; "
        raise InputError(
            f'"{origin}": {given}it needs 1 to {MOST_LEGS} legs, each written as [[legs]] with name and joints.'
        )
    for name, leg in legs.items():
        if not isinstance(leg, dict):
            raise InputError(
                f'"{origin}": leg "{name}" is {shorten(leg)}; it must be a table with name, joints and links.'
            )
    return legs


def with_parts(document: Document, origin: str) -> Document:
    """The document with each series of parts as a table by part; legs, joints and links have names already.

    Raises:
        InputError: a part that is not one; names leg and joint.
    """
    for name, leg in _checked_legs(document["legs"], origin).items():
        for key, part in leg.items():
            if isinstance(part, dict) and is_series(part.get("stiffness")):
                part["stiffness"] = parts(part["stiffness"], f'"{origin}": leg "{name}", joint "{key}": stiffness')
    return document


def _parts_by_name(leg: dict[str, Any], where: str) -> dict[str, Any]:
    """Joints and links of a leg in one table by name."""
    joints, links = leg.pop("joints"), leg.pop("links", {})
    if isinstance(joints, list):
        joints = _entries_by_name(joints, where, "joint")
    if isinstance(links, list):
        links = _entries_by_name(links, where, "link")
    if not isinstance(joints, dict) or not isinstance(links, dict):
        raise InputError(f"{where}: joints must be a list of tables with a name each, links a table of tables.")
    for name in links:
        if name in joints:
            raise InputError(f'{where}: joint "{name}" and link "{name}" share a name; rename one of them.')
        if isinstance(links[name], dict) and "model" not in links[name]:  # otherwise it would pass for a joint
            choice(None, LINK_MODELS, f'{where}, link "{name}": model')
    leg.pop("name", None)
    return {**leg, **joints, **links}


def _entries_by_name(entries: list[Any], where: str, what: str) -> dict[str, Any]:
    by_key: dict[str, Any] = {}
    for i, entry in enumerate(entries, 1):
        name = entry.get("name") if isinstance(entry, dict) else None
        if not isinstance(name, str) or not name.strip() or "." in name or len(name) > 40 or not name.isprintable():
            raise InputError(
                f"{where}: the name of {what} {i} is {shorten(name)}; give each a short name without dots, "
                f'e.g. name = "{what} {i}".'
            )
        if name in by_key:
            raise InputError(f'{where}: two {what}s are called "{name}"; give each a name of its own.')
        by_key[name] = {key: value for key, value in entry.items() if key != "name"}
    return by_key


def check_paths(document: Document, settings: Iterable[str]) -> None:
    """Refuse overrides of legs, joints and links that the document, in which everything has a name, does not have.

    Raises:
        InputError: with what it has.
    """
    for setting in settings:
        path, *names = setting.partition("=")[0].strip().split(".")
        table: Any = document.get(path)
        for name in names[:2] if path == "legs" else ():
            if isinstance(table, dict) and name not in table and not (name in COPY_KEYS and name == names[1]):
                choice(name, table, f"--set {shorten(setting)}: the name after {path}")
            table = table.get(name) if isinstance(table, dict) else None
            path = f"{path}.{name}"


def separate(document: Document, origin: str) -> tuple[Plan, Document]:
    """Plan and numbers of a document in which everything has a name.

    Returns:
        The plan, and what is left of the document: tables of numbers for `spec` to validate.

    Raises:
        InputError: with leg and joint, and how to mend it.
    """
    rest = copy.deepcopy(document)
    space = rest.pop("space", "spatial")
    if space not in ("spatial", "planar"):
        raise InputError(f'"{origin}": space is {shorten(space)}; it must be "spatial" or "planar" (the x-y plane).')
    shapes, materials = _cross_sections(rest, origin)
    legs = _legs(rest["legs"], origin, shapes)
    coordinates = PLANAR_POSE if space == "planar" else SPATIAL_POSE
    pose = rest.get("pose", {})
    for name in pose if isinstance(pose, dict) else ():
        choice(name, coordinates, f'"{origin}": a name in [pose]')
    pose_names = tuple(name for name in coordinates if isinstance(pose, dict) and name in pose)
    if not pose_names:
        raise InputError(f'"{origin}": [pose] must give the task coordinates, some of {", ".join(coordinates)}.')
    plan = Plan(legs=legs, shapes=shapes, materials=materials, pose=pose_names, planar=space == "planar")
    return plan, rest


def _cross_sections(rest: Document, origin: str) -> tuple[dict[str, str], dict[str, str]]:
    shapes, materials = {}, {}
    tables = rest.get("sections", {})
    for name, table in tables.items() if isinstance(tables, dict) else ():
        where = f'"{origin}": cross-section "{name}"'
        if not isinstance(table, dict):
            raise InputError(f"{where} is {shorten(table)}; it must be a table with shape, sizes and material.")
        shapes[name] = choice(table.pop("shape", None), SHAPES, f"{where}: shape")
        materials[name] = ""
        if "material" in table or "youngs_modulus" not in table:
            materials[name] = choice(table.pop("material", None), MATERIALS, f"{where}: material")
    return shapes, materials


def _legs(written: dict[str, Any], origin: str, shapes: Mapping[str, str]) -> tuple[LegPlan, ...]:
    """The legs of a machine with all copies."""
    legs: list[LegPlan] = []
    as_written = copy.deepcopy(written)
    for name, leg in written.items():
        where = f'"{origin}": leg "{name}"'
        copies = copies_in(leg, where)
        legs += legs_of(_leg(name, leg, as_written, where, shapes), copies, where)
    names = [leg.name for leg in legs]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f'"{origin}": a leg and a copy of another are both called "{name}"; rename one of them.')
    if len(legs) > MOST_LEGS:
        raise InputError(
            f'"{origin}": it has {len(legs)} legs with all copies; at most {MOST_LEGS} are allowed, because the work '
            "of sharing loads among them grows with the cube of their number."
        )
    return tuple(legs)


def _leg(name: str, leg: dict[str, Any], legs: Mapping[str, Any], where: str, shapes: Mapping[str, str]) -> LegPlan:
    joints = {key: part for key, part in leg.items() if isinstance(part, dict) and "model" not in part}
    links = {key: part for key, part in leg.items() if isinstance(part, dict) and "model" in part}
    for key in sorted(leg.keys() - joints.keys() - links.keys()):
        raise InputError(f"{where}: {key} is {shorten(leg[key])}; a leg holds joints and links, each a table.")
    if not 1 <= len(joints) <= MOST_JOINTS:
        raise InputError(f"{where} has {len(joints)} joints; it needs 1 to {MOST_JOINTS}, from base to platform.")
    write_directions(joints, where)
    plans = tuple(_joint(key, part, f'{where}, joint "{key}"', shapes) for key, part in joints.items())
    check_chain(name, plans, legs, where)
    for place, plan in enumerate(plans):
        if plan.rod:
            check_strut(plans, place, f'{where}, joint "{plan.name}"')
    bodies = {plan.joins[1] for plan in plans[:-1]}
    for key in links:
        choice(key, bodies, f"{where}: links name")
    flexible = {key: _link(key, links[key], f'{where}, link "{key}"', shapes) for key in links}
    for key in links:  # what is left of a link are its numbers
        if not leg[key]:
            del leg[key]
    return LegPlan(name, plans, flexible)


def _joint(name: str, part: dict[str, Any], where: str, shapes: Mapping[str, str]) -> JointPlan:
    """The plan of a joint; what is left of its part are its numbers."""
    kind = choice(part.pop("type", None), JOINT_TYPES, f"{where}: type")
    joins = part.pop("joins", None)
    if not isinstance(joins, list) or len(joins) != 2 or not all(isinstance(body, str) and body for body in joins):
        raise InputError(f'{where}: joins is {shorten(joins)}; give the two bodies it joins, e.g. ["base", "arm"].')
    actuated, sprung, motor = _drive(kind, part, where)
    series = tuple(part["stiffness"]) if isinstance(part.get("stiffness"), dict) else ()
    compliance = _matrix(part.pop("compliance", []), where)
    seat = _seat(kind, part, bool(compliance), where)
    acts, preloaded = _acts(part, sprung, where), "preload" in part
    rod, section = _rod(part, shapes, where)
    return JointPlan(
        name=name,
        kind=kind,
        joins=(joins[0], joins[1]),
        actuated=actuated,
        sprung=sprung,
        compliance=compliance,
        series=series,
        seat=seat,
        motor=motor,
        preloaded=preloaded,
        acts=acts,
        rod=rod,
        cross_section=section,
    )


def _drive(kind: str, part: dict[str, Any], where: str) -> tuple[bool, bool, str]:
    """Whether a joint is actuated, whether it has a stiffness, and which of several freedoms is actuated."""
    actuated = part.pop("actuated", False)
    motor, sprung = _motor(kind, actuated, where), "stiffness" in part
    if (actuated or sprung) and kind not in ONE_FREEDOM and not motor:
        raise InputError(
            f"{where} is {kind}; only {', '.join(ONE_FREEDOM)} joints may be actuated or have a stiffness."
            + _which(kind, " One of its freedoms may be actuated: write actuated = ")
        )
    if actuated and not sprung:
        example = "20 N/um" if stiffness_kind(kind, motor) == "linear stiffness" else "1e5 N*m/rad"
        raise InputError(
            f'{where} is actuated but has no stiffness; add stiffness = "{example}", or "rigid" if its servo is ideal.'
        )
    return bool(actuated), sprung, motor


def _rod(part: dict[str, Any], shapes: Mapping[str, str], where: str) -> tuple[bool, str]:
    """Whether a joint is a strut with a rod, and the name of the rod's cross-section."""
    rod, section = bool({"section", AXIAL} & part.keys()), part.pop("section", "")
    if section and AXIAL in part:
        raise InputError(f"{where}: section and {AXIAL} both say how its rod stretches; leave one out.")
    return rod, choice(section, shapes, f"{where}: section") if section else ""


def _acts(part: dict[str, Any], sprung: bool, where: str) -> str:
    """The sign of the loads that a joint's spring carries, if it carries only one: "pulls" or "pushes"."""
    for key in ("acts", "preload"):
        if key in part and not sprung:
            raise InputError(
                f"{where}: {key} is for an actuator or a spring; give the joint a stiffness, or omit {key}."
            )
    return choice(part.pop("acts"), ONE_SIDED, f"{where}: acts") if "acts" in part else ""


def _motor(kind: str, actuated: object, where: str) -> str:
    """The freedom of a joint with several that is actuated; empty if it has one freedom or is passive."""
    if isinstance(actuated, bool):
        return ""
    if isinstance(actuated, str) and actuated in JOINT_TYPES[kind].motors:
        return actuated
    which = _which(kind, "write ") or f"a {kind} joint is actuated as a whole or not: write true or false."
    raise InputError(f"{where}: actuated is {shorten(actuated)}; {which}")


def _which(kind: str, before: str) -> str:
    """The freedoms of a joint that may be actuated, as they are written; empty if there are none."""
    names = [f'"{name}"' for name in JOINT_TYPES[kind].motors]
    return f"{before}{' or '.join(names)}." if names else ""


def _seat(kind: str, part: dict[str, Any], has_matrix: bool, where: str) -> tuple[str, ...]:
    """Directions in which the bearings of a joint have a stiffness."""
    seat = tuple(way for way in SEAT if f"stiffness_{way}" in part)
    allowed = JOINT_TYPES[kind].seat
    for way in seat:
        if way not in allowed:
            fields = ", ".join(f"stiffness_{each}" for each in allowed) or "none of these fields"
            raise InputError(
                f"{where}: a {kind} joint cannot have stiffness_{way}, because it moves in that direction; it may have "
                f"{fields}."
            )
    if seat and has_matrix:
        raise InputError(f"{where}: compliance and stiffness_{seat[0]} both describe the bearings; leave one out.")
    if seat and needs_axis(kind) and "axis" not in part:
        raise InputError(
            f"{where}: stiffness_{seat[0]} refers to an axis; add the axis of the bearing, e.g. axis = [0, 0, 1]."
        )
    return seat


def _link(name: str, part: dict[str, Any], where: str, shapes: Mapping[str, str]) -> LinkPlan:
    model = choice(part.pop("model", None), LINK_MODELS, f"{where}: model")
    section = part.pop("section", "")
    if section or model in ("lumped", "beam", "timoshenko"):
        section = choice(section or None, shapes, f"{where}: section")
    up = part.pop("up", None)
    if up is not None and not _numbers(up, 3):
        raise InputError(f"{where}: up is {shorten(up)}; give a direction as three numbers, e.g. [0, 0, 1].")
    compliance = _matrix(part.pop("compliance", []), where)
    if (model == "matrix") != bool(compliance):
        raise InputError(
            f'{where}: model = "matrix" needs compliance, and no other model may have it; add it or leave it out.'
        )
    for key in sorted(part.keys() - WEIGHT.keys()):
        *first, last = WEIGHT
        raise InputError(
            f"{where}: {key} is not known; a link has model, section, up, compliance, {', '.join(first)} and {last}."
        )
    weight = tuple(key for key in WEIGHT if key in part)
    for needed, key in pairwise(WEIGHT):
        if key in weight and needed not in weight:
            raise InputError(f"{where} has {key}, but no {needed}; give its {needed}, or leave {key} out.")
    direction = (float(up[0]), float(up[1]), float(up[2])) if up else None
    return LinkPlan(name=name, model=model, cross_section=section, up=direction, compliance=compliance, weight=weight)


def _matrix(value: object, where: str) -> Matrix:
    """A 6x6 from what was written: nothing, six numbers for its diagonal, or six rows."""
    if value == []:
        return ()
    if _numbers(value, 6):
        value = np.diag(np.array(value, dtype=float)).tolist()
    if not isinstance(value, list) or len(value) != 6 or not all(_numbers(row, 6) for row in value):
        raise InputError(
            f"{where}: compliance is {shorten(value)}; give six numbers (rx, ry, rz in rad/(N·m), x, y, z in m/N) or "
            "six rows of six."
        )
    matrix = np.array(value, dtype=float)
    soft = [float(c) for c in np.diag(matrix) if c > 0.0 and not 1.0 / LARGEST_OTHER <= c <= 1.0 / LEAST_STIFFNESS]
    if soft:
        raise InputError(
            f"{where}: compliance has {soft[0]:g} on its diagonal; give 0 where it is rigid, and elsewhere from "
            f"{1.0 / LARGEST_OTHER:g} to {1.0 / LEAST_STIFFNESS:g} in SI units; what is free is a joint."
        )
    size = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    scaled = matrix / np.where(size > 0.0, size, 1.0)
    if np.abs(scaled - scaled.T).max() > SYMMETRIC or np.linalg.eigvalsh(scaled)[0] < -SYMMETRIC:
        raise InputError(f"{where}: compliance must be symmetric and have no negative eigenvalue (no negative energy).")
    return tuple(tuple(row) for row in matrix.tolist())


def _numbers(value: object, count: int) -> bool:
    return (
        isinstance(value, list)
        and len(value) == count
        and all(isinstance(c, int | float) and not isinstance(c, bool) and abs(c) < LARGEST_NUMBER for c in value)
    )
