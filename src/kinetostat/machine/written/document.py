"""The file of a machine written leg by leg: lists by name, and a plan apart from the numbers, with messages.

Words of a joint, of a link and of a cross-section make the plan (`JOINT_WORDS`, `LINK_WORDS`, `SECTION_WORDS`); all
other fields are numbers, which `spec` checks as in every machine file. No document is changed: each function returns
new tables. Every message names the leg and the joint.
"""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any, TypeGuard

from kinetostat.machine.cross_section import MATERIALS, SHAPES
from kinetostat.machine.parameters import LONGEST_NAME
from kinetostat.machine.series import is_series, parts
from kinetostat.machine.written.checking import ELASTIC, are_numbers, check_chain, compliance_matrix
from kinetostat.machine.written.joints import (
    JOINT_TYPES,
    ONE_FREEDOM,
    SEAT,
    needs_axis,
    stiffness_kind,
    with_directions,
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
    Plan,
    copies_in,
    legs_of,
)
from kinetostat.machine.written.struts import AXIAL, check_strut
from kinetostat.machine.written.tables import WEIGHT
from kinetostat.spec.document import Document
from kinetostat.spec.errors import InputError, choice, shorten

MOST_JOINTS = 24
"""Joints that a leg may have: more is a mistake, and the equations would take minutes."""
CABLE_NEEDS = ("from", "to", "stiffness")
"""Fields that a cable must have: its ends, base frame at the home pose, and the stiffness of its winch."""
WINCH_FIELDS = ("stiffness", "preload")
"""Fields of a cable that are those of its winch; the preload may be left out."""
JOINT_WORDS = ("type", "joins", "actuated", "compliance", "acts", "section")
LINK_WORDS = ("model", "section", "up", "compliance")
SECTION_WORDS = ("shape", "material")
"""Fields of a joint, a link and a cross-section that make the plan; all others are numbers."""


def by_name(document: Document, origin: str) -> Document:
    """The document with its lists of legs and joints as tables by name, so that paths can lead into them.

    Raises:
        InputError: no legs, no name, or one name twice.
    """
    legs = document.get("legs")
    if isinstance(legs, list):
        legs = _entries_by_name(legs, f'"{origin}"', "leg")
    planar = document.get("space") == "planar"
    by_leg = {
        name: _parts_by_name(leg, f'"{origin}": leg "{name}"', planar)
        for name, leg in _checked_legs(legs, origin).items()
    }
    return with_parts({**document, "legs": by_leg}, origin)


def _parts_by_name(leg: dict[str, Any], where: str, planar: bool) -> dict[str, Any]:
    """A leg with its joints and links in one table by name; one that is written as a cable gets the joints of one."""
    if "type" in leg:
        leg = _cable(leg, where, planar)
    if "joints" not in leg:
        return leg
    joints, links = leg["joints"], leg.get("links", {})
    if isinstance(joints, list):
        joints = _entries_by_name(joints, where, "joint")
    if isinstance(links, list):
        links = _entries_by_name(links, where, "link")
    if not isinstance(joints, dict) or not isinstance(links, dict):
        raise InputError(f"{where}: joints must be a list of tables with a name each, links a table of tables.")
    for name, link in links.items():
        if name in joints:
            raise InputError(f'{where}: joint "{name}" and link "{name}" share a name; rename one of them.')
        if isinstance(link, dict) and "model" not in link:  # otherwise it would pass for a joint
            choice(None, LINK_MODELS, f'{where}, link "{name}": model')
    return {**_without(leg, ("name", "joints", "links")), **joints, **links}


def _without(table: Mapping[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key not in keys}


def _cable(leg: dict[str, Any], where: str, planar: bool) -> dict[str, Any]:
    """The joints of a leg that is written as a cable: two ends, and between them an actuator that only pulls."""
    choice(leg.get("type"), (CABLE,), f"{where}: type")
    fields = dict.fromkeys((*CABLE_NEEDS, *WINCH_FIELDS))
    unknown = sorted(leg.keys() - {"type", *fields, *COPY_KEYS, "name"})
    if unknown:
        raise InputError(f"{where}: {unknown[0]} is not known; a cable has {', '.join(fields)}, and may have copies.")
    missing = [key for key in CABLE_NEEDS if key not in leg]
    if missing:
        raise InputError(f'{where} is a cable without {" and ".join(missing)}; write e.g. from = [0, 0, "2 m"].')
    pulls, _ = ONE_SIDED
    ends = [{"type": "revolute", "axis": [0, 0, 1]}] * 2
    if not planar:
        ends = [{"type": "universal", "axis": "eye"}, {"type": "spherical"}]
    winch = {"type": "prismatic", "axis": "eye", "actuated": True, "acts": pulls}
    winch |= {key: leg[key] for key in WINCH_FIELDS if key in leg}
    joints = {
        "anchor": {**ends[0], "joins": [BASE, "cable"], "point": leg["from"]},
        "winch": {**winch, "joins": ["cable", "end"], "point": leg["from"]},
        "eye": {**ends[1], "joins": ["end", PLATFORM], "point": leg["to"]},
    }
    return {**_without(leg, ("type", *fields)), "joints": joints}


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
    legs = {
        name: {
            key: _with_series(part, f'"{origin}": leg "{name}", joint "{key}": stiffness') for key, part in leg.items()
        }
        for name, leg in _checked_legs(document["legs"], origin).items()
    }
    return {**document, "legs": legs}


def _with_series(part: Any, where: str) -> Any:
    if not isinstance(part, dict) or not is_series(part.get("stiffness")):
        return part
    return {**part, "stiffness": parts(part["stiffness"], where)}


def _entries_by_name(entries: list[Any], where: str, what: str) -> dict[str, Any]:
    """Tables by their names, from a list of tables that have a name each; `what` says what each of them is."""
    by_key: dict[str, Any] = {}
    for i, entry in enumerate(entries, 1):
        name = entry.get("name") if isinstance(entry, dict) else None
        if not _is_name(name):
            raise InputError(
                f"{where}: the name of {what} {i} is {shorten(name)}; give each a short name without dots, "
                f'e.g. name = "{what} {i}".'
            )
        if name in by_key:
            raise InputError(f'{where}: two {what}s are called "{name}"; give each a name of its own.')
        by_key[name] = _without(entry, ("name",))
    return by_key


def _is_name(name: object) -> TypeGuard[str]:
    """Whether something can stand in paths as the name of a leg, a joint or a link."""
    return (
        isinstance(name, str)
        and bool(name.strip())
        and len(name) <= LONGEST_NAME
        and "." not in name
        and name.isprintable()
    )


def check_paths(document: Document, settings: Iterable[str]) -> None:
    """Refuse overrides of legs, joints and links that the document, in which everything has a name, does not have.

    Raises:
        InputError: with what it has.
    """
    for setting in settings:
        path, *names = setting.partition("=")[0].strip().split(".")
        table: Any = document.get(path)
        for depth, name in enumerate(names[:2] if path == "legs" else ()):
            is_about_copies = depth == 1 and name in COPY_KEYS
            if isinstance(table, dict) and name not in table and not is_about_copies:
                choice(name, table, f"--set {shorten(setting)}: the name after {path}")
            table = table.get(name) if isinstance(table, dict) else None
            path = f"{path}.{name}"


def separate(document: Document, origin: str) -> tuple[Plan, Document]:
    """Plan and numbers of a document in which everything has a name.

    Returns:
        The plan, and the document without the words that make it: tables of numbers for `spec` to validate.

    Raises:
        InputError: with leg and joint, and how to mend it.
    """
    space = document.get("space", "spatial")
    if space not in ("spatial", "planar"):
        raise InputError(f'"{origin}": space is {shorten(space)}; it must be "spatial" or "planar" (the x-y plane).')
    shapes, materials = _cross_sections(document.get("sections", {}), origin)
    legs, numbers_of_legs = _legs(document["legs"], origin, shapes)
    coordinates = PLANAR_POSE if space == "planar" else SPATIAL_POSE
    pose = document.get("pose", {})
    for name in pose if isinstance(pose, dict) else ():
        choice(name, coordinates, f'"{origin}": a name in [pose]')
    pose_names = tuple(name for name in coordinates if isinstance(pose, dict) and name in pose)
    if not pose_names:
        raise InputError(f'"{origin}": [pose] must give the task coordinates, some of {", ".join(coordinates)}.')
    plan = Plan(legs=legs, shapes=shapes, materials=materials, pose=pose_names, planar=space == "planar")
    numbers = {**_without(document, ("space",)), "legs": numbers_of_legs}
    if shapes:
        numbers["sections"] = {name: _without(table, SECTION_WORDS) for name, table in document["sections"].items()}
    return plan, numbers


def _cross_sections(tables: object, origin: str) -> tuple[dict[str, str], dict[str, str]]:
    """The shapes and the materials of cross-sections by name; the material is empty where E is given in its place."""
    shapes, materials = {}, {}
    for name, table in tables.items() if isinstance(tables, dict) else ():
        where = f'"{origin}": cross-section "{name}"'
        if not isinstance(table, dict):
            raise InputError(f"{where} is {shorten(table)}; it must be a table with shape, sizes and material.")
        shapes[name] = choice(table.get("shape"), SHAPES, f"{where}: shape")
        needs_material = "material" in table or "youngs_modulus" not in table
        materials[name] = choice(table.get("material"), MATERIALS, f"{where}: material") if needs_material else ""
    return shapes, materials


def _legs(
    written: dict[str, Any], origin: str, shapes: Mapping[str, str]
) -> tuple[tuple[LegPlan, ...], dict[str, dict[str, Any]]]:
    """The plans of the legs of a machine with all copies, and the tables of numbers of each leg that is written."""
    legs: list[LegPlan] = []
    numbers = {}
    for name, leg in written.items():
        where = f'"{origin}": leg "{name}"'
        copies = copies_in(leg, where)
        plan, numbers[name] = _leg(name, _without(leg, COPY_KEYS), written, where, shapes)
        legs += legs_of(plan, copies, where)
    names = [leg.name for leg in legs]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise InputError(f'"{origin}": a leg and a copy of another are both called "{repeated}"; rename one of them.')
    if len(legs) > MOST_LEGS:
        raise InputError(
            f'"{origin}": it has {len(legs)} legs with all copies; at most {MOST_LEGS} are allowed, because the work '
            "of sharing loads among them grows with the cube of their number."
        )
    return tuple(legs), numbers


def _leg(
    name: str, leg: dict[str, Any], legs: Mapping[str, Any], where: str, shapes: Mapping[str, str]
) -> tuple[LegPlan, dict[str, Any]]:
    """The plan of a leg, and its tables of numbers: those of each joint, and of each link with a mass.

    Args:
        name: the name of the leg.
        leg: the leg as written, without its fields about copies.
        legs: all legs as written, for messages on bodies that two of them name.
        where: names file and leg in messages.
        shapes: the shapes of the cross-sections by name.
    """
    tables = {key: part for key, part in leg.items() if isinstance(part, dict)}
    links = {key: part for key, part in tables.items() if "model" in part}
    joints = _without(tables, links)
    unknown = sorted(leg.keys() - tables.keys())
    if unknown:
        raise InputError(
            f"{where}: {unknown[0]} is {shorten(leg[unknown[0]])}; a leg holds joints and links, each a table."
        )
    if not 1 <= len(joints) <= MOST_JOINTS:
        raise InputError(f"{where} has {len(joints)} joints; it needs 1 to {MOST_JOINTS}, from base to platform.")
    joints = with_directions(joints, where)
    plans = tuple(_joint(key, part, f'{where}, joint "{key}"', shapes) for key, part in joints.items())
    check_chain(name, plans, legs, where)
    for place, joint in enumerate(plans):
        if joint.rod:
            check_strut(plans, place, f'{where}, joint "{joint.name}"')
    bodies = {plan.joins[1] for plan in plans[:-1]}
    for key in links:
        choice(key, bodies, f"{where}: links name")
    link_plans = {key: _link(key, links[key], f'{where}, link "{key}"', shapes) for key in links}
    numbers = {key: _without(part, JOINT_WORDS) for key, part in joints.items()}
    masses = {key: _without(part, LINK_WORDS) for key, part in links.items()}
    return LegPlan(name, plans, link_plans), {**numbers, **{key: fields for key, fields in masses.items() if fields}}


def _joint(name: str, part: dict[str, Any], where: str, shapes: Mapping[str, str]) -> JointPlan:
    """The plan of a joint, from its table as written."""
    kind = choice(part.get("type"), JOINT_TYPES, f"{where}: type")
    joins = part.get("joins")
    if not isinstance(joins, list) or len(joins) != 2 or not all(isinstance(body, str) and body for body in joins):
        raise InputError(f'{where}: joins is {shorten(joins)}; give the two bodies it joins, e.g. ["base", "arm"].')
    motor = _motor(kind, part.get("actuated", False), where)
    _check_drive(kind, part, motor, where)
    compliance = compliance_matrix(part.get("compliance", []), where)
    return JointPlan(
        name=name,
        kind=kind,
        joins=(joins[0], joins[1]),
        actuated=bool(part.get("actuated", False)),
        sprung="stiffness" in part,
        compliance=compliance,
        series=tuple(part["stiffness"]) if isinstance(part.get("stiffness"), dict) else (),
        seat=_seat(kind, part, bool(compliance), where),
        motor=motor,
        preloaded="preload" in part,
        acts=_acts(part, where),
        rod=bool({"section", AXIAL} & part.keys()),
        cross_section=_rod_section(part, shapes, where),
    )


def _check_drive(kind: str, part: dict[str, Any], motor: str, where: str) -> None:
    """Refuse an actuator or a spring on a joint that cannot have it, and an actuator without a stiffness."""
    actuated, sprung = part.get("actuated", False), "stiffness" in part
    if (actuated or sprung) and kind not in ONE_FREEDOM and not motor:
        raise InputError(
            f"{where} is {kind}; only {', '.join(ONE_FREEDOM)} joints may be actuated or have a stiffness."
            + _motor_advice(kind, " One of its freedoms may be actuated: write actuated = ")
        )
    if actuated and not sprung:
        example = "20 N/um" if stiffness_kind(kind, motor) == "linear stiffness" else "1e5 N*m/rad"
        raise InputError(
            f'{where} is actuated but has no stiffness; add stiffness = "{example}", or "rigid" if its servo is ideal.'
        )


def _rod_section(part: dict[str, Any], shapes: Mapping[str, str], where: str) -> str:
    """The name of the cross-section of a strut's rod; empty if E A is given in its place, or if there is no rod."""
    section = part.get("section", "")
    if section and AXIAL in part:
        raise InputError(f"{where}: section and {AXIAL} both say how its rod stretches; leave one out.")
    return choice(section, shapes, f"{where}: section") if section else ""


def _acts(part: dict[str, Any], where: str) -> str:
    """The sign of the loads that a joint's spring carries, "pulls" or "pushes"; empty if it carries both."""
    for key in ("acts", "preload"):
        if key in part and "stiffness" not in part:
            raise InputError(
                f"{where}: {key} is for an actuator or a spring; give the joint a stiffness, or omit {key}."
            )
    return choice(part["acts"], ONE_SIDED, f"{where}: acts") if "acts" in part else ""


def _motor(kind: str, actuated: object, where: str) -> str:
    """The freedom of a joint with several that is actuated; empty if it has one freedom or is passive."""
    if isinstance(actuated, bool):
        return ""
    if isinstance(actuated, str) and actuated in JOINT_TYPES[kind].motors:
        return actuated
    advice = _motor_advice(kind, "write ") or f"a {kind} joint is actuated as a whole or not: write true or false."
    raise InputError(f"{where}: actuated is {shorten(actuated)}; {advice}")


def _motor_advice(kind: str, before: str) -> str:
    """A clause with the words of `actuated` for a type of joint, after the words before it; empty if it has none."""
    names = [f'"{name}"' for name in JOINT_TYPES[kind].motors]
    return f"{before}{' or '.join(names)}." if names else ""


def _seat(kind: str, part: dict[str, Any], has_matrix: bool, where: str) -> tuple[str, ...]:
    """Directions in which the bearings of a joint have a stiffness."""
    seat = tuple(way for way in SEAT if f"stiffness_{way}" in part)
    allowed = JOINT_TYPES[kind].seat
    moving = [way for way in seat if way not in allowed]
    if moving:
        fields = ", ".join(f"stiffness_{way}" for way in allowed) or "none of these fields"
        raise InputError(
            f"{where}: a {kind} joint cannot have stiffness_{moving[0]}, because it moves in that direction; it may "
            f"have {fields}."
        )
    if seat and has_matrix:
        raise InputError(f"{where}: compliance and stiffness_{seat[0]} both describe the bearings; leave one out.")
    if seat and needs_axis(kind) and "axis" not in part:
        raise InputError(
            f"{where}: stiffness_{seat[0]} refers to an axis; add the axis of the bearing, e.g. axis = [0, 0, 1]."
        )
    return seat


def _link(name: str, part: dict[str, Any], where: str, shapes: Mapping[str, str]) -> LinkPlan:
    """The plan of a link, from its table as written."""
    model = choice(part["model"], LINK_MODELS, f"{where}: model")
    section = part.get("section", "")
    if section or model in ELASTIC:
        section = choice(section or None, shapes, f"{where}: section")
    up = part.get("up")
    if up is not None and not are_numbers(up, 3):
        raise InputError(f"{where}: up is {shorten(up)}; give a direction as three numbers, e.g. [0, 0, 1].")
    compliance = compliance_matrix(part.get("compliance", []), where)
    if (model == "matrix") != bool(compliance):
        raise InputError(
            f'{where}: model = "matrix" needs compliance, and no other model may have it; add it or leave it out.'
        )
    unknown = sorted(part.keys() - {*LINK_WORDS, *WEIGHT})
    if unknown:
        *first, last = (*LINK_WORDS, *WEIGHT)
        raise InputError(f"{where}: {unknown[0]} is not known; a link has {', '.join(first)} and {last}.")
    weight = tuple(key for key in WEIGHT if key in part)
    for needed, key in pairwise(WEIGHT):
        if key in weight and needed not in weight:
            raise InputError(f"{where} has {key}, but no {needed}; give its {needed}, or leave {key} out.")
    direction = (float(up[0]), float(up[1]), float(up[2])) if up else None
    return LinkPlan(name=name, model=model, cross_section=section, up=direction, compliance=compliance, weight=weight)
