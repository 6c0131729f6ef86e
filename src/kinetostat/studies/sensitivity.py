"""Which parameters decide how stiff a machine is: derivatives of its indices at its pose, compared and ranked.

Derivatives are exact; the joints of a machine written leg by leg follow. What is printed or drawn of it is elsewhere.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Table
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Machine, need_machine
from kinetostat.machine.parameters import Parameter, parameters, values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.grid.quantities import refuse_absent, resolve_quantities
from kinetostat.studies.plain_data import as_answer
from kinetostat.units import KINDS

WITHOUT_INFLUENCE = ("load", "limits")
"""Sections on which no index depends."""
ZERO = 1e-9
"""Share of what a number is compared with below which it counts as zero: it is then the rounding of one."""
NEGLIGIBLE = 1e-9
"""Percent per percent below which a parameter has no influence: the rounding of zero."""
ROUNDING = 1e-12
"""Share of what its rows yield or hold beside others below which an entry of C or K is the rounding of zero."""

MOST_NAMED = 12
"""Parameters without influence that are named."""

PER = "percent per percent, of an angle per 0.01 rad"
"""What the numbers are. An angle counts from an axis of choice, and with 360 deg more it is the same."""

RIGID = "because rigid (a relative change is undefined)"
FREE = "because free (C is infinite, or does not depend on it)"
OPENS = "as the legs would no longer close if one of them changed alone"


def greatest_of(percents: Sequence[float | None]) -> float:
    """Size of the greatest; 0 if there is none."""
    return max((abs(percent) for percent in percents if percent is not None), default=0.0)


@dataclass(frozen=True)
class Influence:
    """What one parameter does to the indices.

    Attributes:
        path: of the parameter.
        kind: a key of `units.KINDS`.
        value: SI.
        percent_of: what one percent of a change is of, SI: the value itself, or a `measure`.
        measure: "itself", "length" where a length is zero (the machine's characteristic length), "radian" of an angle
            (whose percent is 0.01 rad), or "axis" (the direction's length).
        derivatives: of each index by it, SI; None where the index is infinite.
        percents: percent by which each index changes per percent of a change; None where the index is infinite, or 0 up
            to rounding.
    """

    path: str
    kind: str
    value: float
    percent_of: float
    measure: str
    derivatives: tuple[float | None, ...]
    percents: tuple[float | None, ...]

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents; 0 if there is none."""
        return greatest_of(self.percents)


@dataclass(frozen=True)
class Sensitivity:
    """The answer at one pose.

    Attributes:
        machine: what was asked about.
        status: of the pose; all that follows is empty unless it is OK.
        message: one readable paragraph.
        quantities: names of the indices.
        found: their values, SI; infinite where rigid or free, 0 where they are but rounding.
        length: characteristic length, m.
        influences: the parameters that have one, the greatest first.
        none: paths of those that have none.
        skipped: paths of those without a derivative, and why.
    """

    machine: Machine
    status: Status
    message: str
    quantities: tuple[str, ...] = ()
    found: tuple[float, ...] = ()
    length: float = math.nan
    influences: tuple[Influence, ...] = ()
    none: tuple[str, ...] = ()
    skipped: tuple[tuple[str, str], ...] = ()

    def __repr__(self) -> str:
        return f"<Sensitivity of {self.machine.name!r}: {self.status.word}, {len(self.influences)} parameters>"


def sensitivity(machine: Machine, quantities: Sequence[str] = ("compliance",)) -> Sensitivity:
    """How indices of a machine at its pose depend on each of its design parameters and pose coordinates.

    Args:
        machine: with its pose.
        quantities: names of quantities or groups.

    Raises:
        InputError: an unknown quantity, or one that the machine cannot have.
    """
    need_machine(machine)
    names = tuple(resolve_quantities(quantities, machine.family.component_names))
    refuse_absent(machine, names)
    asked = [p for p in parameters(machine.family) if len(p.leaves) == 1 and _decides(p, names)]
    held = values(machine)
    by = [p.path for p in asked if not math.isinf(held[p.path])]
    anywhere = next(path for path in held if path.startswith("pose."))
    answer = evaluate_gradient(machine, Table({anywhere: np.array([held[anywhere]])}), names, by)
    status = Status(int(answer.status[0]))
    if status is not Status.OK:
        return Sensitivity(machine, status, analyze(machine).message)
    response = respond(machine)
    length = float(response.configuration.length)
    found = tuple(_felt(name, value, response) for name, value in zip(names, answer.values[:, 0].tolist(), strict=True))
    slopes = dict(zip(by, answer.gradients[:, :, 0].T.tolist(), strict=True))
    skipped = {path: reason for path, reason in ((p.path, _why_not(p, held, slopes)) for p in asked) if reason}
    every = [_influence(p, held, found, slopes[p.path], length) for p in asked if p.path not in skipped]
    ranked = sorted((one for one in every if one.greatest > NEGLIGIBLE), key=lambda one: -one.greatest)
    none = tuple(one.path for one in every if one.greatest <= NEGLIGIBLE)
    return Sensitivity(
        machine, status, status.sentence, names, found, length, tuple(ranked), none, tuple(skipped.items())
    )


def _felt(name: str, value: float, response: Response) -> float:
    """An index, 0 where it is an entry of C or K that is but the rounding of zero: a rigid or a free direction."""
    about = QUANTITIES[name].components
    if not about or not math.isfinite(value):
        return value
    matrix = response.compliance if name.startswith("compliance") else response.stiffness
    shrink = 1.0 / float(response.configuration.length)
    arms = [1.0] * 3 + [shrink] * 3 if matrix is response.compliance else [shrink] * 3 + [1.0] * 3
    diagonal = [abs(float(entry)) * arm * arm for entry, arm in zip(matrix.diagonal(), arms, strict=True)]
    largest = max((size for size in diagonal if math.isfinite(size)), default=0.0)
    first, last = (COMPONENTS.index(about[k]) for k in (0, -1))
    seen = min(diagonal[first], diagonal[last]) > ROUNDING * ROUNDING * largest
    compared = math.sqrt(diagonal[first]) * math.sqrt(diagonal[last])
    return value if seen and abs(value) * arms[first] * arms[last] > ROUNDING * compared else 0.0


def _decides(parameter: Parameter, names: Sequence[str]) -> bool:
    if KINDS[parameter.quantity.kind].heavy and "mass" not in names:
        return False
    return parameter.path.split(".")[0] not in WITHOUT_INFLUENCE


def _why_not(parameter: Parameter, held: dict[str, float], slopes: dict[str, list[float]]) -> str:
    """Why there is no derivative by a parameter; empty if there is one."""
    value = held[parameter.path]
    if math.isinf(value):
        return RIGID
    if parameter.quantity.stiff and value == 0.0:
        return FREE
    return OPENS if all(math.isnan(slope) for slope in slopes[parameter.path]) else ""


def _influence(
    parameter: Parameter, held: dict[str, float], found: Sequence[float], slopes: Sequence[float], length: float
) -> Influence:
    value, kind = held[parameter.path], parameter.quantity.kind
    percent_of, measure = _one_percent_of(parameter, held, length)
    pairs = list(zip(slopes, found, strict=True))
    return Influence(
        parameter.path,
        kind,
        value,
        percent_of,
        measure,
        tuple(None if math.isnan(slope) else slope for slope, _ in pairs),
        tuple(percent_of * slope / index if 0.0 < abs(index) < math.inf else None for slope, index in pairs),
    )


def _one_percent_of(parameter: Parameter, held: dict[str, float], length: float) -> tuple[float, str]:
    """What a change of a parameter is compared with, SI, and what that is."""
    path, kind = parameter.path, parameter.quantity.kind
    value = abs(held[path])
    if kind == "direction":
        field = path.rpartition(".")[0]
        return math.hypot(*(held[f"{field}.{i}"] for i in range(3))), "axis"
    if kind == "length" and value <= ZERO * length:
        return length, "length"
    if kind == "angle":
        return 1.0, "radian"
    return value, "itself"


def as_json(answer: Sensitivity) -> dict[str, Any]:
    """A sensitivity as plain data."""
    names = answer.quantities
    return as_answer(
        {
            "name": answer.machine.name,
            "status": answer.status.word,
            "message": answer.message,
            "characteristic_length": answer.length if answer.influences else None,
            "indices": {
                name: {"value": value, "units": QUANTITIES[name].unit}
                for name, value in zip(names, answer.found, strict=True)
            },
            "parameters": [
                {
                    "path": one.path,
                    "value": one.value,
                    "units": KINDS[one.kind].unit,
                    "one_percent_of": {"measure": one.measure, "value": one.percent_of},
                    "derivatives": dict(zip(names, one.derivatives, strict=True)),
                    "percent_per_percent": dict(zip(names, one.percents, strict=True)),
                }
                for one in answer.influences
            ],
            "without_influence": answer.none,
            "without_derivative": dict(answer.skipped),
        }
    )


def notes(answer: Sensitivity) -> Iterator[str]:
    """What a reader of the percentages must know, in sentences."""
    used = {one.measure for one in answer.influences}
    meanings = {
        "length": f"where a length is 0, a percent is one of the characteristic length, {answer.length:.4g} m",
        "radian": "of an angle, a percent is 0.01 rad (0.57 deg), whatever its value",
        "axis": "of a direction, a percent is one of its length",
    }
    said = [meaning for measure, meaning in meanings.items() if measure in used]
    yield "; ".join(["Percent of the result per percent of the parameter", *said]) + "."
    for reason in dict.fromkeys(reason for _, reason in answer.skipped):
        yield f"Omitted {reason}: {', '.join(path for path, why in answer.skipped if why == reason)}."
    if answer.none:
        shown = answer.none[:MOST_NAMED]
        more = f" and {len(answer.none) - len(shown)} more" if len(answer.none) > len(shown) else ""
        yield f"Without influence: {', '.join(shown)}{more}."
