"""Sensitivity of a machine's stiffness at one pose to its parameters: exact derivatives, made comparable and ranked.

Tables and bars of it are in `views`; the derivatives come from `engine.derivatives`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from enum import Flag, StrEnum, auto
from typing import TYPE_CHECKING, NamedTuple

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


class _Subject(Flag):
    """Subjects that quantities may have, and on which fields may act."""

    STIFFNESS = auto()
    """C and K of the free machine, from its geometry and its springs; every quantity has this subject."""
    MASS = auto()
    """The mass of all that moves."""
    INERTIA = auto()
    """Vibrations, and what drives carry when the machine accelerates."""
    LOST_MOTION = auto()
    """The error of the tool where drives reverse."""
    ACTUATOR_LOADS = auto()
    """The loads of actuators of the free machine, to first order, and what drives can do beside these."""
    REST = auto()
    """The machine at rest under its loads."""

    @classmethod
    def of(cls, machine: Machine, names: Sequence[str]) -> "_Subject":
        """The subjects of some quantities of a machine."""
        quantities = [QUANTITIES[name] for name in names]
        subjects = cls.STIFFNESS
        if "mass" in names:
            subjects |= cls.MASS
        if needs_masses(names) or any(quantity.modal for quantity in quantities):
            subjects |= cls.INERTIA
        if any(quantity.driven == "reversal" for quantity in quantities):
            subjects |= cls.LOST_MOTION
        if any(quantity.name in LOADS_OF_ACTUATORS or quantity.driven in CARRYING for quantity in quantities):
            subjects |= cls.ACTUATOR_LOADS
        if rest_numbers(machine, names, limited=False):
            subjects |= cls.REST
        return subjects


class _Effect(NamedTuple):
    """The effect of a field.

    Attributes:
        subjects: the subjects on which it acts.
        nonzero_for: subjects that ask for derivatives only where the value of the field is not 0: a link without mass
            has no motion of its own, and a play that is not there loses none.
    """

    subjects: _Subject
    nonzero_for: _Subject = _Subject(0)


_WEIGHT_OF_PLATFORM = _Subject.INERTIA | _Subject.ACTUATOR_LOADS | _Subject.REST
"""Subjects on which the platform acts by its weight. To first order actuators carry the platform, and no links."""
_EFFECTS_BY_PATH = {
    ("limits.", "bending_rigidity.", "cutting.", "cables."): _Effect(_Subject(0)),
    ("load.min_tension", "load.max_tension"): _Effect(_Subject(0)),  # chosen tensions have no derivatives
    ("load.",): _Effect(_Subject.ACTUATOR_LOADS | _Subject.REST),
    ("expansion.", "temperature_rise."): _Effect(_Subject.REST),
    ("damping.", "drives.rotor_damping"): _Effect(_Subject.LOST_MOTION, nonzero_for=_Subject.LOST_MOTION),
    ("servo.",): _Effect(_Subject.LOST_MOTION | _Subject.INERTIA, nonzero_for=_Subject.LOST_MOTION),
    ("drives.",): _Effect(_Subject.LOST_MOTION | _Subject.INERTIA, nonzero_for=_Subject.LOST_MOTION | _Subject.INERTIA),
    ("tool.inertia", "tool.payload_inertia"): _Effect(_Subject.INERTIA),
    ("tool.payload", "tool.centre_of_mass."): _Effect(_WEIGHT_OF_PLATFORM),
    ("tool.mass",): _Effect(_WEIGHT_OF_PLATFORM | _Subject.MASS),
}
"""Effects of fields by the beginnings of their paths, of which the first that fits counts: single fields stand before
their table. Fields that have none of these beginnings act by their kind, see `_effect_of`."""
NO_STATE_NEARBY = (
    "Newton's method does not lead from the unloaded pose to a stable state of rest nearby, so that there are no "
    "derivatives here. Look at the loaded state (analyze --loaded), and reduce the loads."
)
"""The answer where a machine has no state of rest near its pose."""
MOST_NAMED = 12
"""Greatest number of parameters without influence that are named: two lines of a terminal."""

UNIT_OF_PERCENTS = "percent per percent, for an angle per 0.01 rad"
"""Unit of the percentages; see `Measure`."""

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
        size: the amount of which one percent is a percent of change of the parameter, SI; see `percent_base`.
        index: the index, SI.
    """
    with np.errstate(all="ignore"):
        ratio = np.multiply(size, slope) / index
        is_defined = np.isfinite(index) & (np.abs(index) > 0.0) & (np.abs(size) > 0.0)
    return np.where(is_defined, ratio, math.nan)


class Measure(StrEnum):
    """The amounts of which one percent may be a percent of change of a parameter."""

    ITSELF = "itself"
    """The value of the parameter."""
    LENGTH = "length"
    """The characteristic length of the machine, for a length of zero."""
    RADIAN = "radian"
    """1 rad, for an angle: the zero of an angle is a convention, so that a percent of its value has no meaning."""
    AXIS = "axis"
    """The length of a direction, for its components."""


class PercentBase(NamedTuple):
    """The amount of which one percent is a percent of change of a parameter, SI, and what it is."""

    amount: float
    measure: Measure


def percent_base(kind: str, value: float, length: float) -> PercentBase:
    """Return the amount of which one percent is a percent of change of a parameter, `Measure.AXIS` apart.

    Args:
        kind: kind of the parameter, a key of `units.KINDS`.
        value: value of the parameter, SI.
        length: characteristic length, m.
    """
    if kind == "length" and abs(value) <= ZERO_LENGTH * length:
        return PercentBase(length, Measure.LENGTH)
    return PercentBase(1.0, Measure.RADIAN) if kind == "angle" else PercentBase(abs(value), Measure.ITSELF)


@dataclass(frozen=True, eq=False)
class Influence(ImmutableAnswer):
    """The effect of one parameter on the indices.

    Attributes:
        path: path of the parameter.
        kind: kind of the parameter, a key of `units.KINDS`.
        value: its value, SI.
        percent_of: the amount of which one percent is a percent of change, SI.
        measure: what this amount is.
        derivatives: derivative of each index by it, SI; NaN where the index is infinite [indices].
        percents: percent by which each index changes per percent of a change; NaN where `relative_sensitivity` is not
            defined [indices].
    """

    path: str
    kind: str
    value: float
    percent_of: float
    measure: Measure
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
    numbers, subjects = values(machine), _Subject.of(machine, names)
    scalars = [p for p in parameters(machine.family) if len(p.leaves) == 1]
    candidates = [p for p in scalars if _may_influence(p, numbers[p.path], subjects)]
    varied = [p.path for p in candidates if not math.isinf(numbers[p.path])]
    answer = evaluate_gradient(machine, point_of_file(machine), names, varied)
    status = Status(int(answer.status[0]))
    if status is not Status.OK:
        why = NO_STATE_NEARBY if status is Status.NOT_CONVERGED else state.refusal
        return Sensitivity(machine, status, why, loads_left_out=uncounted)
    pairs = zip(names, answer.values[:, 0].tolist(), strict=True)
    indices = np.array([_without_round_off(machine, name, value, response) for name, value in pairs])
    slopes = dict(zip(varied, answer.gradients[:, :, 0].T.tolist(), strict=True))
    reasons = {p.path: _no_derivative(p, numbers[p.path], slopes.get(p.path, ())) for p in candidates}
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
    components = QUANTITIES[name].components
    if not components or not math.isfinite(value) or needs_state(machine, [name], limited=False):
        return value
    is_compliance, length = name.startswith("compliance"), float(response.configuration.length)
    matrix = response.compliance if is_compliance else response.stiffness
    # With these factors all entries have the unit of the translational ones: rotations count at the machine's length.
    rotation_factor = 1.0 / length
    factors = [1.0] * 3 + [rotation_factor] * 3 if is_compliance else [rotation_factor] * 3 + [1.0] * 3
    diagonal = [abs(float(entry)) * factor**2 for entry, factor in zip(matrix.diagonal(), factors, strict=True)]
    largest = max((size for size in diagonal if math.isfinite(size)), default=0.0)
    row, column = COMPONENTS.index(components[0]), COMPONENTS.index(components[-1])
    # An entry of the diagonal is the square of a motion, so that the share of the motion counts squared; another entry
    # is at most the geometric mean of the two of the diagonal that it couples.
    if min(diagonal[row], diagonal[column]) <= ROUND_OFF_OF_ENTRY**2 * largest:
        return 0.0
    coupled = math.sqrt(diagonal[row]) * math.sqrt(diagonal[column])
    return value if abs(value) * factors[row] * factors[column] > ROUND_OFF_OF_ENTRY * coupled else 0.0


def _may_influence(parameter: Parameter, value: float, subjects: _Subject) -> bool:
    """Whether any quantity about the given subjects may depend on a parameter with a value, SI."""
    effect = _effect_of(parameter)
    return bool(effect.subjects & subjects) and not (value == 0.0 and effect.nonzero_for & subjects)


def _effect_of(parameter: Parameter) -> _Effect:
    """The effect of a parameter: that of its table, or of the masses of links and joints, or else on C and K."""
    for beginnings, effect in _EFFECTS_BY_PATH.items():
        if parameter.path.startswith(beginnings):
            return effect
    if parameter.quantity.kind == "inertia":
        return _Effect(_Subject.INERTIA)
    if ".centre_of_mass." in parameter.path:
        return _Effect(_Subject.INERTIA | _Subject.REST)
    if KINDS[parameter.quantity.kind].heavy:
        return _Effect(_Subject.MASS | _Subject.INERTIA | _Subject.REST, nonzero_for=_Subject.INERTIA)
    return _Effect(_Subject.STIFFNESS)


def _no_derivative(parameter: Parameter, value: float, slopes: Sequence[float]) -> str:
    """Why there is no derivative by a parameter; empty if there is one.

    Args:
        parameter: the parameter.
        value: its value, SI.
        slopes: derivatives of all indices by it; none of a value that is infinite.
    """
    if math.isinf(value):
        return BECAUSE_RIGID
    if parameter.quantity.stiff and value == 0.0:
        return BECAUSE_FREE
    return BECAUSE_OPEN if all(math.isnan(slope) for slope in slopes) else ""


def _influence(
    parameter: Parameter, value_by_path: Mapping[str, float], indices: Array, slopes: Sequence[float], length: float
) -> Influence:
    """The effect of a parameter on indices, by the derivatives of these, at a machine of some characteristic length."""
    path, kind = parameter.path, parameter.quantity.kind
    base = percent_base(kind, value_by_path[path], length)
    if kind == "direction":
        direction = path.rpartition(".")[0]
        base = PercentBase(math.hypot(*(value_by_path[f"{direction}.{i}"] for i in range(3))), Measure.AXIS)
    return Influence(
        path=path,
        kind=kind,
        value=value_by_path[path],
        percent_of=base.amount,
        measure=base.measure,
        derivatives=np.array(slopes, dtype=float),
        percents=relative_sensitivity(np.array(slopes), base.amount, indices),
    )


def notes(answer: Sensitivity) -> Iterator[str]:
    """Explain in sentences what the percentages refer to, and which parameters are omitted."""
    used = {parameter.measure for parameter in answer.parameters}
    length = answer.machine.display.show(answer.characteristic_length, "m")
    meanings = {
        Measure.LENGTH: f"for a length of 0, one percent is that of the characteristic length, {length}",
        Measure.RADIAN: "for an angle of any value, one percent is 0.01 rad (0.57 deg)",
        Measure.AXIS: "for a component of a direction, one percent is that of the length of the direction",
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
