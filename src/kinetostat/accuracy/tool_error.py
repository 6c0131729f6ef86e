"""The error of the tool by independent errors of the machine: its measures, and how large they get.

Measures are components of the twist of the tool, lengths of some of them, a direction, and what no actuator corrects.
Their sizes are computed to first order, for the worst case, as percentiles of random machines, and for some machines by
exact solutions; these differ from the first order by curvature, and by what errors do only together.

Source: theory (48), (50), (52) and (53).
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.toleranced_parts import RandomInputs
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Integers
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import Immutable
from kinetostat.tolerances import LEAST_DIVISOR, NO_FREEDOM

PARASITIC = "parasitic "
"""Prefix of the measures of what no actuator corrects."""
USUAL_PERCENT = 95.0
"""Percent of all machines that the usual error covers."""
STARTS = 200
"""Random directions from which the worst case of a length is searched at a single pose: a search ends in a local
maximum, and so many find the greatest of them."""
FEW_STARTS = 24
"""The same at each of many poses, where the time counts and neighbours show a maximum that was missed."""
SAME_LENGTH = 1e-12
"""Relative growth of the worst case in a step below which it is round-off."""
MOST_WORST_CASE_STEPS = 100
"""Most steps of that search, which nearly always ends after ten."""
SOLVED_AT_ONCE = 1024
"""Machines that are solved together: their matrices stay in the cache, and calls of NumPy cost little of the time."""


@dataclass(frozen=True)
class Measures:
    """Numbers of a twist that people ask for.

    Attributes:
        rows: rows of the linear measures by name, applied to a twist (rad, m) [6], or others at each pose [n x 6].
        lengths: names of the rows of which a measure is the length, by its name.
        units: "rad" or "m", by name.
    """

    rows: Mapping[str, Array]
    lengths: Mapping[str, tuple[str, ...]]
    units: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all components, those of the rows first."""
        return (*self.rows, *self.lengths)

    def linear(self, twists: Array) -> Array:
        """Return the linear measures of twists at n poses [n x 6 x q] -> [n x rows x q]."""
        count = len(twists)
        matrix = np.stack([np.broadcast_to(row, (count, 6)) for row in self.rows.values()], axis=1)
        return np.asarray(matrix @ twists)

    def row_numbers(self, name: str) -> list[int]:
        """Return the numbers of the rows that a measure is made of."""
        names = list(self.rows)
        return [names.index(row) for row in self.lengths.get(name, (name,))]

    def sizes(self, rows: Array) -> Array:
        """Return all measures as sizes from values of the linear ones [... x rows] -> [... x measures]."""
        lengths = [np.linalg.norm(rows[..., self.row_numbers(name)], axis=-1) for name in self.lengths]
        return np.concatenate([np.abs(rows), *(length[..., None] for length in lengths)], axis=-1)


def measures_of(
    drives: Array, components: Sequence[str], along: Array | None, length: float
) -> tuple[Measures, int, tuple[str, ...]]:
    """List the measures of the twist of the tool.

    Args:
        drives: twist of the tool per unit of each actuator, SI [n x 6 x actuators].
        components: components of the twist that the machine has.
        along: unit vector, base axes; None if no direction is asked for.
        length: length by which rotations count beside displacements, m.

    Returns:
        The measures, the number of freedoms that the actuators move, and the components that none of them moves.
    """
    rows: dict[str, Array] = {name: np.eye(6)[COMPONENTS.index(name)] for name in components}
    if along is not None:
        rows["along"] = np.concatenate([np.zeros(3), along])
    correction = _correction(drives, components, length)
    lengths = _lengths(components, "")
    if correction.freedoms < len(components):
        rows |= {f"{PARASITIC}{name}": correction.remainder[:, COMPONENTS.index(name)] for name in components}
        lengths |= _lengths(components, PARASITIC)
    units = {name: "rad" if _is_angle(name) else "m" for name in (*rows, *lengths)}
    return Measures(rows, lengths, units), correction.freedoms, correction.parasitic


def _is_angle(name: str) -> bool:
    return name.removeprefix(PARASITIC) in ("rx", "ry", "rz", "rotation")


def _lengths(components: Sequence[str], prefix: str) -> dict[str, tuple[str, ...]]:
    """Return the rows of the angle and of the distance, where they have more than one component."""
    rows_of_length = {
        "rotation": tuple(f"{prefix}{name}" for name in components if _is_angle(name)),
        "position": tuple(f"{prefix}{name}" for name in components if not _is_angle(name)),
    }
    return {f"{prefix}{name}": rows for name, rows in rows_of_length.items() if len(rows) > 1}


class _Correction(NamedTuple):
    """Effect of small corrections of the actuators.

    Attributes:
        remainder: the map from an error of the tool to what they leave of it [n x 6 x 6].
        freedoms: number of freedoms that the actuators move.
        parasitic: components that none of them moves.
    """

    remainder: Array
    freedoms: int
    parasitic: tuple[str, ...]


def _correction(drives: Array, components: Sequence[str], length: float) -> _Correction:
    """Find what small corrections of the actuators leave of an error of the tool, theory (53).

    Corrections take as much away as they can, rotations times the length counting like displacements. Arguments are
    those of `measures_of`.
    """
    scale = np.array([length] * 3 + [1.0] * 3)
    motions = drives * scale[:, None]
    basis, sizes, _ = np.linalg.svd(motions, full_matrices=False)
    is_freedom = sizes > NO_FREEDOM * sizes.max(axis=1, initial=LEAST_DIVISOR)[:, None]
    basis = basis * is_freedom[:, None]
    remainder = np.eye(6) - basis @ np.swapaxes(basis, 1, 2)
    # Without round-off, so that nothing remains of what actuators correct, and all of what none of them moves.
    remainder = np.where(np.abs(remainder) < NO_FREEDOM, 0.0, remainder)
    greatest = np.abs(motions).max(initial=0.0)
    parasitic = [
        name for name in components if (np.abs(motions[:, COMPONENTS.index(name)]) <= NO_FREEDOM * greatest).all()
    ]
    return _Correction(remainder * scale / scale[:, None], int(is_freedom.sum(axis=1).min()), tuple(parasitic))


class FirstOrder(NamedTuple):
    """The error of the tool at n poses to first order: a column for each measure.

    Attributes:
        mean: the error of the average machine, as a size [n x measures].
        rms: root of the mean square over all machines [n x measures].
        rss: the mean, plus the root of the sum of squares of what each limit alone adds [n x measures].
        worst: the largest error that the limits allow [n x measures].
    """

    mean: Array
    rms: Array
    rss: Array
    worst: Array


@dataclass(frozen=True)
class Spread:
    """The error of the tool at n poses with percentiles of random machines: a column for each measure.

    Attributes:
        mean, rms, rss, worst: see `FirstOrder`.
        usual: the error within which `USUAL_PERCENT` of all machines keep [n x measures].
        everywhere: the error within which `USUAL_PERCENT` of all machines keep at all these poses [measures].
    """

    mean: Array
    rms: Array
    rss: Array
    worst: Array
    usual: Array
    everywhere: Array


def first_order(inputs: RandomInputs, measures: Measures) -> FirstOrder:
    """Compute the statistics of the error of the tool that need no random machines [n x measures], theory (50).

    Args:
        inputs: the variables and their effects.
        measures: the measures.
    """
    rows, shift = _linear_effects(inputs, measures)
    variances, squared_limits, worst, mean = [], [], [], measures.sizes(shift)
    for name in measures.names:
        row_numbers = measures.row_numbers(name)
        rows_of_measure = rows[:, row_numbers]
        variances.append((rows_of_measure**2 @ inputs.variance).sum(axis=1))
        squared_limits.append((rows_of_measure**2).sum(axis=(1, 2)))
        worst.append(_worst_case(rows_of_measure, shift[:, row_numbers], inputs))
    rms = np.sqrt(mean**2 + np.stack(variances, axis=1))
    rss = mean + np.sqrt(np.stack(squared_limits, axis=1))
    return FirstOrder(mean, rms, rss, np.stack(worst, axis=1))


def _linear_effects(inputs: RandomInputs, measures: Measures) -> tuple[Array, Array]:
    """Return the linear measures per unit of each variable [n x rows x q], and where all variables are 0 [n x rows]."""
    return measures.linear(inputs.columns), measures.linear(inputs.shift[:, :, None])[:, :, 0]


def _worst_case(rows: Array, shift: Array, inputs: RandomInputs) -> Array:
    """Return the largest length that limits allow [n], theory (52): the greatest sum along any direction.

    Args:
        rows: effect of each variable [n x k x q].
        shift: the error when all variables are 0 [n x k].
        inputs: the variables, some of which keep a limit together.
    """
    single = np.array([block[0] for block in inputs.blocks if len(block) == 1], dtype=int)
    joint = [block for block in inputs.blocks if len(block) > 1]
    count, size, _ = rows.shape
    if size == 1:
        reach = np.abs(rows[:, 0, single]).sum(axis=1) + np.abs(shift[:, 0])
        return np.asarray(reach + sum(np.linalg.norm(rows[:, 0, block], axis=1) for block in joint))
    # The seed is fixed, so that the answer never depends on chance.
    directions = np.random.default_rng(0).standard_normal((STARTS if count == 1 else FEW_STARTS, size))
    directions = np.broadcast_to(directions / np.linalg.norm(directions, axis=1)[:, None], (count, *directions.shape))
    worst = np.zeros(count)
    for _ in range(MOST_WORST_CASE_STEPS):
        # The machine that reaches farthest along a direction lies in a direction of its own, which is tried next:
        # its length never falls.
        farthest = _farthest(directions, rows, shift, single, joint)
        lengths = np.linalg.norm(farthest, axis=2)
        directions = farthest / np.maximum(lengths, LEAST_DIVISOR)[:, :, None]
        longest = lengths.max(axis=1)
        if (longest <= worst * (1.0 + SAME_LENGTH)).all():
            break
        worst = np.maximum(worst, longest)
    return worst


def _farthest(directions: Array, rows: Array, shift: Array, single: Integers, joint: Sequence[Integers]) -> Array:
    """Return the error of the machine that reaches farthest along each direction [n x directions x k].

    Args:
        directions: unit vectors [n x directions x k].
        rows, shift: see `_worst_case`.
        single, joint: numbers of the variables that keep a limit each, and of those that keep one together.
    """
    result = np.sign(directions @ rows[:, :, single]) @ np.swapaxes(rows[:, :, single], 1, 2)
    for block in joint:
        reach = directions @ rows[:, :, block]
        reach = reach / np.maximum(np.linalg.norm(reach, axis=2, keepdims=True), LEAST_DIVISOR)
        result = result + reach @ np.swapaxes(rows[:, :, block], 1, 2)
    return result + np.sign(np.einsum("nsk,nk->ns", directions, shift))[:, :, None] * shift[:, None]


def spread_of(inputs: RandomInputs, measures: Measures, machines: Iterable[Array]) -> tuple[Spread, Array]:
    """Return the error of the tool to first order, with percentiles of random machines.

    Args:
        inputs: the variables and their effects at n poses.
        measures: the measures.
        machines: values of the variables, slab by slab [slab x q].

    Returns:
        The errors, and of each machine its largest one over all poses [machines x measures].
    """
    rows, shift = _linear_effects(inputs, measures)
    count, size, _ = rows.shape
    effects = rows.reshape(count * size, -1).T
    slab_sizes = [measures.sizes((slab @ effects).reshape(len(slab), count, size) + shift) for slab in machines]
    sizes = np.concatenate(slab_sizes)
    largest = sizes.max(axis=1)
    usual, everywhere = (np.percentile(over_machines, USUAL_PERCENT, axis=0) for over_machines in (sizes, largest))
    return Spread(**first_order(inputs, measures)._asdict(), usual=usual, everywhere=everywhere), largest


def variance_by_part(inputs: RandomInputs, measures: Measures) -> Array:
    """Return the variance that each part brings to each measure, summed over the poses [measures x parts].

    Source: theory (50).
    """
    rows = measures.linear(inputs.columns)
    by_variable = np.einsum("nkq,q->kq", rows**2, inputs.variance)
    by_part = np.zeros((len(by_variable), len(inputs.parts)))
    np.add.at(by_part.T, inputs.owner, by_variable.T)
    return np.stack([by_part[measures.row_numbers(name)].sum(axis=0) for name in measures.names])


def shares(variances: Array) -> Array:
    """Return variances as shares that add up to 1 in each row; 0 where there is nothing to share."""
    whole = variances.sum(axis=1, keepdims=True)
    return np.divide(variances, whole, out=np.zeros_like(variances), where=whole > 0.0)


@dataclass(frozen=True, eq=False)
class ExactSample(Immutable):
    """Machines whose equations were solved exactly, at the pose of the machine.

    Attributes:
        machines: number of machines.
        failed: number of those that cannot be assembled with their actuators there.
        rms: root of the mean square of each measure [measures].
        usual: the error within which `USUAL_PERCENT` of them keep [measures].
        difference: the largest difference of a measure from its first order [measures].
        unexplained: share of the variance that single contributions do not explain [measures]; 0 where nothing varies.
    """

    machines: int
    failed: int
    rms: Array
    usual: Array
    difference: Array
    unexplained: Array


def exact_sample(machine: Machine, inputs: RandomInputs, measures: Measures, count: int, seed: int) -> ExactSample:
    """Solve machines exactly at the pose of the machine.

    Args:
        machine: the machine as drawn.
        inputs: the variables and their effects there.
        measures: the measures.
        count: number of machines, a power of 2.
        seed: seed of the random machines.

    Raises:
        InputError: none of them can be assembled.
    """
    solved, linear = _solved_and_linear(machine, inputs, measures, count, seed)
    is_closed = np.isfinite(solved).all(axis=1)
    if not is_closed.any():
        raise InputError(
            f"{machine.name}: none of the {count:,} machines can be assembled with its actuators there; make the "
            "tolerances smaller."
        )
    solved, linear = solved[is_closed], linear[is_closed]
    sizes = measures.sizes(solved)
    return ExactSample(
        machines=count,
        failed=int((~is_closed).sum()),
        rms=np.sqrt((sizes**2).mean(axis=0)),
        usual=np.percentile(sizes, USUAL_PERCENT, axis=0),
        difference=np.abs(sizes - measures.sizes(linear)).max(axis=0),
        unexplained=_unexplained_variance(solved, linear, measures),
    )


def _solved_and_linear(
    machine: Machine, inputs: RandomInputs, measures: Measures, count: int, seed: int
) -> tuple[Array, Array]:
    """Return linear measures of machines by exact solutions, and to first order [machines x rows each].

    NaN without a solution. Arguments are those of `exact_sample`.
    """
    path = next(path for path in values(machine) if path.startswith(POSE))
    coordinate = float(values(machine)[path])
    solved, linear = [], []
    model: ErrorModel | None = None
    for slab in inputs.machines(count, seed):
        for start in range(0, len(slab), SOLVED_AT_ONCE):
            variables = slab[start : start + SOLVED_AT_ONCE]
            if model is None or len(model) != len(variables):  # one machine for each pose of the model, all the same
                model = error_model(machine, {path: np.full(len(variables), coordinate)}, len(variables))
            exact, _ = model.displacement(inputs.drawn + variables @ inputs.errors.T)
            twists_to_first_order = inputs.shift[0] + variables @ inputs.columns[0].T
            solved.append(measures.linear(exact.T[None])[0].T)
            linear.append(measures.linear(twists_to_first_order.T[None])[0].T)
    return np.concatenate(solved), np.concatenate(linear)


def _unexplained_variance(solved: Array, linear: Array, measures: Measures) -> Array:
    """Return the variance of what the first order leaves, over the variance [machines x rows] -> [measures]."""
    row_variances = (solved - linear).var(axis=0), solved.var(axis=0)
    row_numbers = [measures.row_numbers(name) for name in measures.names]
    remainder, whole = (np.array([variance[rows].sum() for rows in row_numbers]) for variance in row_variances)
    return np.divide(remainder, whole, out=np.zeros_like(remainder), where=whole > 0.0)
