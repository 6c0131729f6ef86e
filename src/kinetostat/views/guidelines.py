"""Design guidelines: the question, and the description of its answer. Only rounding is computed here."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from rich.text import Text

from kinetostat.arrays import Array
from kinetostat.display import DASH, Scale, number
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import Element
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.guideline_sentences import (
    DECIDING_SHARE,
    LEAST_EFFECT,
    limit_of,
    share_with_same_signs,
    statements,
)
from kinetostat.studies.guidelines import EXCESS_OF_RIGID, Guidelines, Roles, guidelines
from kinetostat.views.data_forms import stiffness_of_spring
from kinetostat.views.question import (
    FIRST_FIELDS,
    LOADS_LEFT_OUT,
    Description,
    Field,
    Lines,
    Question,
    Records,
    ranges_option,
)
from kinetostat.views.tables import FittedTable, numeric_table, text_table, words_on_omitted

TOPICS = {"compliance": "Depends on", "weakest": "Weakest", "rigid": "Rigid", "design": "Design"}
"""Words before the sentences of a topic."""
DIGITS_OF_K = 6
"""Digits of the coefficients of K, which are compared with those of papers."""
BOLD_SHARE = 0.5
"""Share from which an element is printed in bold: it alone contributes more than all others."""
MOST_PARAMETERS = 16
"""Parameters that have a line unless all are wanted: the strongest, which fill half of a screen."""
MOST_NAMED_PATHS = 8
"""Paths of parameters that a sentence names, on two lines; it counts the others."""
NO_EFFECT = "·"
"""Sign in tables for an effect that is too small to count; a direction that is rigid or free has a dash."""


def _lines(answer: Guidelines) -> Lines:
    answered, poses = answer.poses
    about = f"{' '.join(answer.components)} (base axes): deflection under a load in the same direction."
    if poses:
        about += f" Over {', '.join(answer.ranges)}: {answered:,} of {poses:,} poses have a result."
    yield "Directions", about
    for statement in statements(answer):
        extent = "" if statement.holds is None else f" [{over_poses(statement.holds)}]"
        yield TOPICS[statement.topic], f"{statement.text}{extent}"
    if answer.roles is not None:
        yield "Percent", answer.meaning
        yield from (("Others", sentence) for sentence in _left_out(answer))


def over_poses(share: float) -> str:
    """Say at how many poses a statement is true."""
    return "everywhere" if share == 1.0 else f"at {100 * share:.3g} % of the poses"


def _left_out(answer: Guidelines) -> Iterator[str]:
    """Write sentences on the parameters that the tables omit, and why."""
    hidden = len(answer.parameters) - MOST_PARAMETERS
    if hidden > 0:
        yield f"{words_on_omitted(hidden)} (--full shows them)."
    if answer.without_influence:
        yield f"No direction depends on {_few_paths(answer.without_influence)}."
    for reason in dict.fromkeys(why for _, why in answer.parameters_left_out):
        yield f"Omitted {reason}: {_few_paths([path for path, why in answer.parameters_left_out if why == reason])}."


def _few_paths(paths: Sequence[str]) -> str:
    """List the first paths, and count the others."""
    others = len(paths) - MOST_NAMED_PATHS
    return ", ".join(paths[:MOST_NAMED_PATHS]) + (f" and {others} more" if others > 0 else "")


def _tables(answer: Guidelines, full: bool) -> Iterator[FittedTable]:
    if answer.roles is None:
        return
    if answer.stiffness_equations is not None:
        yield _equation_table(answer, answer.stiffness_equations)
    if answer.elements:
        yield _element_table(answer, answer.roles)
        yield _limit_table(answer, answer.roles)
    if answer.parameters:
        yield _effect_table(answer, len(answer.parameters) if full else MOST_PARAMETERS)


def _equation_table(answer: Guidelines, rows: dict[str, Array]) -> FittedTable:
    """Write K as sums over elements, in the form of the paper's equations 33-38."""
    table = text_table("K at this pose as a sum over elements; k is the stiffness of one part (SI)", "entry", "sum")
    for i, name in enumerate(answer.components):
        parts = (f"{number(row[i], digits=DIGITS_OF_K)} k({element})" for element, row in rows.items() if row[i] != 0.0)
        table.add_row(f"K_{name}", " + ".join(parts) or "0")
    return table


def _element_table(answer: Guidelines, roles: Roles) -> FittedTable:
    """Return the share of each element in the compliance of each direction."""
    table = numeric_table("Attribution: share of each element in the diagonal of C", "element", answer.components)
    for element, row in zip(answer.elements, _at_pose(roles.shares).tolist(), strict=True):
        table.add_row(element.name, *(_share_text(part) for part in row))
    return table


def _share_text(part: float) -> Text:
    if math.isnan(part) or part == 0.0:
        return Text(NO_EFFECT if part == 0.0 else DASH)
    return Text(f"{100 * part:.1f} %", "bold" if part >= BOLD_SHARE else "" if part >= DECIDING_SHARE else "dim")


def _limit_table(answer: Guidelines, roles: Roles) -> FittedTable:
    """Return the stiffness from which each element counts as rigid.

    An element with several stiffnesses has no single value: its limits are multiples of the present stiffness.
    """
    title = (
        f"Stiffness from which an element counts as rigid, within {100.0 * EXCESS_OF_RIGID:g} % "
        f"({NO_EFFECT} any stiffness suffices; never: nothing else is compliant in that direction)"
    )
    table = numeric_table(title, "element", ["now", *answer.components])
    for k, element in enumerate(answer.elements):
        factors, scale = _at_pose(roles.rigid)[k].tolist(), answer.machine.display.scale(element.unit)
        present = unit_of_limits(element, scale)
        if element.stiffness is None:
            now = "1 × now"
        else:
            now = f"rigid ({scale.unit})" if math.isinf(element.stiffness) else f"{_limit_text(present)} {scale.unit}"
        table.add_row(element.name, now, *(_limit_text(factor * present) for factor in factors))
    return table


def unit_of_limits(element: Element, scale: Scale) -> float:
    """Return the number by which factors on the stiffness of an element become limits as they are shown.

    It is the present stiffness; for an element with several stiffnesses 1, as its limits stay factors; and for a rigid
    element 1 in SI, as its factors are stiffnesses themselves.

    Args:
        element: the element.
        scale: the scale in which its stiffnesses are shown.
    """
    return 1.0 if element.stiffness is None else limit_of(element.stiffness, 1.0) * scale.factor


def _limit_text(value: float) -> str:
    """Return a limit in few characters: in two digits from 1000 on, else in three."""
    if math.isnan(value):
        return DASH
    if value == 0.0 or math.isinf(value):
        return NO_EFFECT if value == 0.0 else "never"
    text = f"{value:.2g}" if value >= 1000.0 else f"{value:.3g}"
    return text.replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def _effect_table(answer: Guidelines, count: int) -> FittedTable:
    """Return the effect of the first parameters on each direction."""
    grid = bool(answer.poses.answered)
    title = "Effect of 1 % more (of an angle: 0.01 rad more), percent stiffer ▲ or softer ▼"
    if grid:
        title += "; poses: share of the poses at which all arrows of the row point the same way as here"
    table = numeric_table(title, "parameter", [*answer.components, *(["poses"] if grid else [])])
    for effect in answer.parameters[:count]:
        share = share_with_same_signs(effect)
        poses = "all" if share is None or share == 1.0 else f"{100.0 * share:.0f} %"
        name = with_leg(answer.machine, effect.path)
        table.add_row(name, *(_effect_text(p) for p in effect.percents), *([poses] if grid else []))
    return table


def _effect_text(percent: float) -> Text:
    if not abs(percent) >= LEAST_EFFECT:
        return Text(DASH if math.isnan(percent) else NO_EFFECT)
    size = f"{abs(percent):.2f}" if abs(percent) < 1.0 else f"{abs(percent):.2g}"
    return Text(f"▲{size}", "blue") if percent > 0.0 else Text(f"▼{size}", "red")


def _elements(answer: Guidelines) -> list[dict[str, Any]]:
    """Return the elements with their roles at the pose and over the grid, by direction."""
    at_pose, over = answer.roles, answer.roles_over_grid
    if at_pose is None:
        return []
    by_direction = partial(_by_direction, answer)
    shares, rigid, gains = map(_at_pose, (at_pose.shares, at_pose.rigid, at_pose.gains))
    rows = []
    for k, element in enumerate(answer.elements):
        limits = [None if element.stiffness is None else limit_of(element.stiffness, factor) for factor in rigid[k]]
        row: dict[str, Any] = {
            "name": element.name,
            "parts": element.parts,
            "actuated": element.actuated,
            "units": element.unit or None,
            "stiffness": stiffness_of_spring(element.stiffness),
            "compliance_share": by_direction(shares[k]),
            "rigid_from_factor": by_direction(rigid[k]),
            "rigid_from": by_direction(limits),
            "rigid_from_per_actuator": by_direction([_in_actuators(limit, answer.actuator) for limit in limits]),
            "doubling_lowers_compliance": by_direction(gains[k]),
        }
        if over is not None:
            row["over_grid"] = {
                "least_share": by_direction(over.shares[k].min(axis=1)),
                "greatest_share": by_direction(over.shares[k].max(axis=1)),
                "rigid_from_factor": by_direction(over.rigid[k].max(axis=1)),
            }
        rows.append(row)
    return rows


def _at_pose(roles: Array) -> Array:
    """Take roles [elements x components x poses] at the only pose of `Guidelines.roles` [elements x components]."""
    return roles[:, :, 0]


def _in_actuators(limit: float | None, actuator: Element | None) -> float | None:
    """Return a limit in units of an actuator's stiffness; 0 stays 0, also where there is nothing to compare with."""
    if limit is None or limit == 0.0:
        return limit
    return limit / actuator.stiffness if actuator and actuator.stiffness else None


def _parameters(answer: Guidelines) -> list[dict[str, Any]]:
    """Return the parameters with their effects by direction."""
    rows = []
    for effect in answer.parameters:
        row: dict[str, Any] = {
            "path": effect.path,
            "one_percent": "0.01 rad" if effect.turning else "1 %",
            "stiffer_percent_per_percent": _by_direction(answer, effect.percents),
        }
        if effect.stiffer:
            row["stiffer_at"] = _by_direction(answer, effect.stiffer)
            row["softer_at"] = _by_direction(answer, effect.softer)
        rows.append(row)
    return rows


def _by_direction(answer: Guidelines, row: Any) -> dict[str, Any]:
    return dict(zip(answer.components, row, strict=True))


def _equations(answer: Guidelines) -> dict[str, dict[str, Any]] | None:
    """Return the coefficients of K by element and direction."""
    rows = answer.stiffness_equations
    return None if rows is None else {name: _by_direction(answer, row) for name, row in rows.items()}


def _grid(answer: Guidelines) -> dict[str, Any] | None:
    answered, poses = answer.poses
    return {"over": answer.ranges, "poses": poses, "answered": answered} if answer.ranges else None


DIRECTIONS = ("component",)
"""Axis of values by direction."""
ELEMENT = (
    Field("name", long_name="elastic element", column="element_name"),
    Field("parts", forms=("json",)),
    Field("actuated"),
    Field("units", forms=("json",)),
    Field("stiffness", forms=("json",)),
    Field("compliance_share", unit="1", long_name="share of the diagonal of C", axes=DIRECTIONS),
    Field("rigid_from_factor", unit="1", long_name="multiple of the stiffness from which it is rigid", axes=DIRECTIONS),
    Field("rigid_from", long_name="stiffness from which it is rigid, SI", axes=DIRECTIONS),
    Field(
        "rigid_from_per_actuator",
        long_name="stiffness from which it is rigid, as a multiple of an actuator's",
        axes=DIRECTIONS,
    ),
    Field("doubling_lowers_compliance", unit="1", long_name="share that doubling gains", axes=DIRECTIONS),
    Field("over_grid", lambda row: row.get("over_grid"), forms=("json",), optional=True),
)
PARAMETER = (
    Field("path", long_name="parameter"),
    Field("one_percent", long_name="change that counts as one percent"),
    Field("stiffer_percent_per_percent", unit="1", long_name="percent stiffer per percent more", axes=DIRECTIONS),
    Field("stiffer_at", lambda row: row.get("stiffer_at"), forms=("json", "csv"), optional=True),
    Field("softer_at", lambda row: row.get("softer_at"), forms=("json", "csv"), optional=True),
)
GUIDELINES = Description(
    title="Guidelines",
    fields=(
        *FIRST_FIELDS,
        LOADS_LEFT_OUT,
        Field("components"),
        Field("rigid_within", lambda _answer: EXCESS_OF_RIGID),
        Field(
            "compliance_diagonal",
            lambda answer: answer.compliance_diagonal if answer.compliance_diagonal.size else None,
        ),
        Records("elements", "element", ELEMENT, _elements, forms=("json", "nc")),
        Field("stiffness_equations", _equations),
        Records("parameters", "parameter", PARAMETER, _parameters),
        Field("without_influence"),
        Field("left_out", lambda answer: dict(answer.parameters_left_out)),
        Field("statements", statements),
        Field("grid", _grid),
    ),
    lines=_lines,
    tables=_tables,
    figures="views.guideline_figures.guideline_figures",
    state=lambda answer: "design guidelines" if answer.status is Status.OK else answer.status.word,
    answered=lambda answer: answer.status is Status.OK,
    files={"guidelines.json": "json"},
)
GUIDELINES_QUESTION = Question(
    example='kinetostat guidelines zhang-gosselin-4dof --over "x=-2 cm:2 cm:11" --over "z=66 cm:70 cm:11" -o out',
    answer=guidelines,
    options=(
        ranges_option(
            "a coordinate of the pose and its range: count at how many poses the guidelines hold; repeatable"
        ),
    ),
    output="the figures and JSON",
    reports_progress=True,
    full="show every parameter",
)
