"""Sensitivity of a machine's stiffness at one pose to its parameters: exact derivatives, made comparable and ranked.

Tables and bars of it are in `views`; the derivatives come from `engine.derivatives`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import (
    CARRYING,
    LOADS_OF_ACTUATORS,
    QUANTITIES,
    needs_masses,
    needs_state,
    rest_numbers,
)
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.common_tables import DYNAMIC_FIELDS
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, data_name, parameters, values
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.attribution import strongest_first
from kinetostat.studies.evaluation import point_of_file
from kinetostat.studies.quantities import (
    cable_count,
    refuse_absent,
    refuse_without_derivatives,
    resolve_quantities,
    uncounted_loads,
)
from kinetostat.tolerances import NO_INFLUENCE, ROUND_OFF_OF_ENTRY, ZERO_LENGTH
from kinetostat.units import KINDS

if TYPE_CHECKING:
    import pandas as pd

WITHOUT_INFLUENCE = (
    "load.", "limits.", "tool.payload", "bending_rigidity.", "expansion.", "temperature_rise.",
)  # fmt: skip
"""Beginnings of the fields on which no index of the free machine depends: loads, limits, buckling and growth."""
WITHOUT_DERIVATIVES = ("limits.", "bending_rigidity.", "damping.", "cutting.", "cables.", "drives.rotor_damping")
"""Beginnings of the fields on which no quantity with derivatives depends, but lost motion on some of them."""
FIELDS_OF_LOST_MOTION = ("drives.", "servo.", "damping.")
"""Beginnings of the fields on which lost motion depends."""
TENSION_BOUNDS = ("load.min_tension", "load.max_tension")
"""Fields on which nothing about the loaded machine depends; chosen tensions have no derivatives."""
NO_STATE_NEARBY = (
    "Newton's method does not lead from the unloaded pose to a stable state of rest nearby, so that there are no "
    "derivatives here. Look at the loaded state (analyze --loaded), and reduce the loads."
)
"""The answer where a machine has no state of rest near its pose."""
MOST_NAMED = 12
"""Greatest number of parameters without influence that are named: two lines of a terminal."""

UNIT_OF_PERCENTS = "percent per percent, for an angle per 0.01 rad"
"""Unit of the percentages. A percent of an angle has no meaning, because the zero of an angle is a convention."""

BECAUSE_RIGID = "because rigid (a relative change is undefined)"
"""The reason why there is no derivative by an infinite stiffness."""
BECAUSE_FREE = "because free (C is infinite, or does not depend on it)"
"""The reason why there is none by a stiffness of zero."""
BECAUSE_OPEN = "because the legs would no longer close if one of them changed alone"
"""The reason why there is none by a length of a closed loop."""


def greatest_of(percents: Array) -> float:
    """Return the size of the greatest percentage; 0 if there is none."""
    return float(np.fmax.reduce(np.abs(percents), initial=0.0))


def relative_sensitivity(slope: Array | float, size: Array | float, index: Array | float) -> Array:
    """Return the relative change of an index per relative change of a parameter: size * slope / index.

    All studies compare sensitivities by this rule. It is undefined (NaN) where the index is zero or infinite, and where
    the size is zero: a percent of zero changes nothing.

    Args:
        slope: derivative of the index by the parameter, SI.
        size: the amount of which one percent is a percent of change of the parameter, SI; see `measure_of`.
        index: the index, SI.
    """
    with np.errstate(all="ignore"):
        ratio = np.multiply(size, slope) / index
        is_defined = np.isfinite(index) & (np.abs(index) > 0.0) & (np.abs(size) > 0.0)
    return np.where(is_defined, ratio, math.nan)


def measure_of(kind: str, value: float, length: float) -> tuple[float, str]:
    """Return the amount of which one percent is a percent of change of a parameter, SI, and the name of that measure.

    It is the parameter itself, except for a length of zero, where it is the characteristic length of the machine, and
    for an angle, where it is 1 rad.

    Args:
        kind: kind of the parameter, a key of `units.KINDS`; entries of a direction are measured by its length instead.
        value: value of the parameter, SI.
        length: characteristic length, m.
    """
    if kind == "length" and abs(value) <= ZERO_LENGTH * length:
        return length, "length"
    return (1.0, "radian") if kind == "angle" else (abs(value), "itself")


@dataclass(frozen=True, eq=False)
class Influence(ImmutableAnswer):
    """The effect of one parameter on the indices.

    Attributes:
        path: path of the parameter.
        kind: kind of the parameter, a key of `units.KINDS`.
        value: its value, SI.
        percent_of: the amount of which one percent is a percent of change, SI: the value itself, or a `measure`.
        measure: "itself", "length" where a length is zero (the machine's characteristic length), "radian" of an angle
            (whose percent is 0.01 rad), or "axis" (the direction's length).
        derivatives: derivative of each index by it, SI; NaN where the index is infinite [indices].
        percents: percent by which each index changes per percent of a change; NaN where the index is infinite, or 0 up
            to round-off.
    """

    path: str
    kind: str
    value: float
    percent_of: float
    measure: str
    derivatives: Array
    percents: Array

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents; 0 if there is none."""
        return greatest_of(self.percents)


@former_names(
    found="indices",
    length="characteristic_length",
    influences="parameters",
    none="without_influence",
    skipped="without_derivative",
)
@dataclass(frozen=True, eq=False)
class Sensitivity(ImmutableAnswer):
    """Sensitivities at one pose, ranked.

    Attributes:
        machine: the machine.
        status: status of the pose; all that follows is empty unless it is OK.
        message: one readable paragraph.
        quantities: names of the indices.
        indices: their values, SI; infinite where rigid or free, 0 where they are only round-off.
        characteristic_length: characteristic length of the machine, m.
        parameters: parameters that have an influence, the greatest first.
        without_influence: paths of those that have none.
        without_derivative: paths of those without a derivative, each with the reason.
        loads_left_out: a sentence on the loads of the file that do not count; empty where all do.
    """

    machine: Machine
    status: Status
    message: str
    quantities: tuple[str, ...] = ()
    indices: Array = field(default_factory=lambda: np.zeros(0))
    characteristic_length: float = math.nan
    parameters: tuple[Influence, ...] = ()
    without_influence: tuple[str, ...] = ()
    without_derivative: tuple[tuple[str, str], ...] = ()
    loads_left_out: str = ""

    def to_pandas(self) -> "pd.DataFrame":
        """Return a table of pandas, SI: for each parameter its value, and derivative and percent of each index."""
        import pandas as pd  # takes long to load

        heads = [f"{name} {what}" for what in ("derivative", "percent") for name in self.quantities]
        rows = [[data_name(p.path), p.value, *p.derivatives, *p.percents] for p in self.parameters]
        return pd.DataFrame(rows, columns=["parameter", "value", *heads]).set_index("parameter")

    def __repr__(self) -> str:
        return f"<Sensitivity of {self.machine.name!r}: {self.status.word}, {len(self.parameters)} parameters>"


@checked
def sensitivity(machine: Machine | MachineState, quantities: Sequence[str] = ("compliance",)) -> Sensitivity:
    """Compute how indices of a machine at its pose depend on each design parameter and pose coordinate.

    Derivatives are exact. In a machine written leg by leg, the joints follow each change so that the legs stay closed.

    Args:
        machine: the machine at its pose, or its state, as `state_of` returns it.
        quantities: names of quantities or groups.

    Raises:
        InputError: an unknown quantity, or one that the machine cannot have.
    """
    state = state_of(machine)
    machine = state.machine
    names = tuple(resolve_quantities(quantities, machine.family.component_names, cable_count(machine)))
    if not names:
        raise InputError("quantities names none; give at least one quantity or group.")
    refuse_without_derivatives(machine, names)
    refuse_absent(state, names)
    uncounted = uncounted_loads(state, names)
    response = state.response
    if state.status in (Status.JOINT_LIMIT, Status.NO_REST):
        return Sensitivity(machine, state.status, state.refusal, loads_left_out=uncounted)
    numbers = values(machine)
    candidates = [p for p in parameters(machine.family) if len(p.leaves) == 1 and _decides(machine, p, names, numbers)]
    varied = [p.path for p in candidates if not math.isinf(numbers[p.path])]
    answer = evaluate_gradient(machine, point_of_file(machine), names, varied)
    status = Status(int(answer.status[0]))
    if status is not Status.OK:
        why = NO_STATE_NEARBY if status is Status.NOT_CONVERGED else state.refusal
        return Sensitivity(machine, status, why, loads_left_out=uncounted)
    pairs = zip(names, answer.values[:, 0].tolist(), strict=True)
    indices = np.array([_without_round_off(machine, name, value, response) for name, value in pairs])
    slopes = dict(zip(varied, answer.gradients[:, :, 0].T.tolist(), strict=True))
    reasons = {p.path: _no_derivative(p, numbers, slopes) for p in candidates}
    length = float(response.configuration.length)
    influences = [_influence(p, numbers, indices, slopes[p.path], length) for p in candidates if not reasons[p.path]]
    return Sensitivity(
        machine=machine,
        status=status,
        message=status.sentence,
        quantities=names,
        indices=indices,
        characteristic_length=length,
        parameters=tuple(strongest_first([item for item in influences if item.greatest > NO_INFLUENCE])),
        without_influence=tuple(item.path for item in influences if item.greatest <= NO_INFLUENCE),
        without_derivative=tuple((path, reason) for path, reason in reasons.items() if reason),
        loads_left_out=uncounted,
    )


def _without_round_off(machine: Machine, name: str, value: float, response: Response) -> float:
    """An index, set to zero where it is an entry of C or K that is only round-off: of a rigid or a free direction."""
    about = QUANTITIES[name].components
    if not about or not math.isfinite(value) or needs_state(machine, [name], limited=False):
        return value
    matrix = response.compliance if name.startswith("compliance") else response.stiffness
    shrink = 1.0 / float(response.configuration.length)
    arms = [1.0] * 3 + [shrink] * 3 if matrix is response.compliance else [shrink] * 3 + [1.0] * 3
    diagonal = [abs(float(entry)) * arm * arm for entry, arm in zip(matrix.diagonal(), arms, strict=True)]
    largest = max((size for size in diagonal if math.isfinite(size)), default=0.0)
    first, last = (COMPONENTS.index(about[k]) for k in (0, -1))
    present = min(diagonal[first], diagonal[last]) > ROUND_OFF_OF_ENTRY * ROUND_OFF_OF_ENTRY * largest
    compared = math.sqrt(diagonal[first]) * math.sqrt(diagonal[last])
    return value if present and abs(value) * arms[first] * arms[last] > ROUND_OFF_OF_ENTRY * compared else 0.0


def _decides(machine: Machine, parameter: Parameter, names: Sequence[str], here: Mapping[str, float]) -> bool:
    """Whether any of the quantities may depend on a parameter."""
    path, quantities = parameter.path, [QUANTITIES[name] for name in names]
    inertial = any(quantity.modal for quantity in quantities) or needs_masses(names)
    if path.startswith(FIELDS_OF_LOST_MOTION) and any(quantity.driven == "reversal" for quantity in quantities):
        return here[path] != 0.0
    if path.startswith(WITHOUT_DERIVATIVES) or (path.startswith(DYNAMIC_FIELDS) and not inertial):
        return False
    if parameter.quantity.kind == "inertia":
        return inertial
    of_mass = KINDS[parameter.quantity.kind].heavy or path.startswith("drives.")
    if inertial and of_mass and not path.startswith("tool."):
        return here[path] != 0.0  # a link or rotor without mass has no motion of its own
    if rest_numbers(machine, names, limited=False):
        return not path.startswith(TENSION_BOUNDS)
    driven = any(name in LOADS_OF_ACTUATORS or QUANTITIES[name].driven in CARRYING for name in names)
    if driven and path.startswith(("load.", "tool.")):
        return not path.startswith(TENSION_BOUNDS)  # to first order, actuators carry the loads and the platform
    if ".centre_of_mass." in path or (inertial and path.startswith("tool.")):
        return inertial
    return not path.startswith(WITHOUT_INFLUENCE) and ("mass" in names or not of_mass)


def _no_derivative(parameter: Parameter, here: dict[str, float], slopes: dict[str, list[float]]) -> str:
    """Why there is no derivative by a parameter; empty if there is one."""
    value = here[parameter.path]
    if math.isinf(value):
        return BECAUSE_RIGID
    if parameter.quantity.stiff and value == 0.0:
        return BECAUSE_FREE
    return BECAUSE_OPEN if all(math.isnan(slope) for slope in slopes[parameter.path]) else ""


def _influence(
    parameter: Parameter, here: dict[str, float], indices: Array, slopes: Sequence[float], length: float
) -> Influence:
    path, kind = parameter.path, parameter.quantity.kind
    if kind == "direction":
        axis = path.rpartition(".")[0]
        size, measure = math.hypot(*(here[f"{axis}.{i}"] for i in range(3))), "axis"
    else:
        size, measure = measure_of(kind, here[path], length)
    return Influence(
        path=path,
        kind=kind,
        value=here[path],
        percent_of=size,
        measure=measure,
        derivatives=np.array(slopes, dtype=float),
        percents=relative_sensitivity(np.array(slopes), size, indices),
    )


def notes(answer: Sensitivity) -> Iterator[str]:
    """Explain in sentences what the percentages refer to, and which parameters are omitted."""
    used = {parameter.measure for parameter in answer.parameters}
    length = answer.machine.display.show(answer.characteristic_length, "m")
    meanings = {
        "length": f"for a length of 0, one percent is that of the characteristic length, {length}",
        "radian": "for an angle of any value, one percent is 0.01 rad (0.57 deg)",
        "axis": "for a component of a direction, one percent is that of the length of the direction",
    }
    explained = [meaning for measure, meaning in meanings.items() if measure in used]
    yield "; ".join(["Percent of the result per percent of the parameter", *explained]) + "."
    for reason in dict.fromkeys(reason for _, reason in answer.without_derivative):
        yield f"Omitted {reason}: {', '.join(path for path, why in answer.without_derivative if why == reason)}."
    if answer.without_influence:
        shown = answer.without_influence[:MOST_NAMED]
        rest = len(answer.without_influence) - len(shown)
        more = f" and {rest} more" if rest else ""
        yield f"Without influence: {', '.join(shown)}{more}."
