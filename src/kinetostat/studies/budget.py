"""The error of the tool that the tolerances of a machine allow: at its pose, at poses of a list, or over a grid.

Actuators stand where the drawn machine has them. To first order the error is a matrix times the errors of the machine,
so that a million machines take a second; the equations of the machine can be solved exactly for fewer of them.

Source: theory (50)-(54).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinetostat.accuracy.model import ErrorModel, error_model
from kinetostat.accuracy.toleranced_parts import RandomInputs, TolerancedPart, random_inputs, toleranced_parts
from kinetostat.accuracy.tool_error import (
    PARASITIC,
    USUAL_PERCENT,
    ExactSample,
    Measures,
    Spread,
    exact_sample,
    measures_of,
    shares,
    spread_of,
    variance_by_part,
)
from kinetostat.arrays import Array, Codes, Integers, Mask
from kinetostat.display import number, with_unit
from kinetostat.engine.batch import Progress, silent
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.loads import platform_is_loaded
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice, shorten
from kinetostat.spec.fields import positive_number
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.spec.tolerance_table import Tolerance, joined_tolerances, read_tolerances
from kinetostat.studies.allocation import ALLOCATION_RULES, Allocation, allocation_for, effects_of_limits
from kinetostat.studies.attribution import ranking_of
from kinetostat.studies.datasets import GridQuestion, grid_question
from kinetostat.studies.directions import unit_direction
from kinetostat.studies.poses import PoseColumns, given_poses
from kinetostat.tolerances import NO_EFFECT

SAMPLES, FEW_SAMPLES = 1 << 17, 1 << 12
"""Machines that are drawn if nobody says how many: at a single pose, and at each of many. Powers of 2, because so many
Sobol points are even. The error that 95 % keep within has a standard error of 0.2 % with the first and 1 % with the
second."""
MOST_DRAWN_MACHINES = 1 << 21
"""Machines that may be drawn: their errors take some hundred megabytes."""
MOST_EXACT = 1 << 17
"""Machines that may be solved exactly, each by Newton's method: minutes."""
MOST_BUDGET_POSES = 200_000
"""Poses of a budget: each has hundreds of numbers that are kept."""
DRAWN_POSES_AT_ONCE = 128
"""Poses whose machines are drawn together: enough that the time of a call does not count."""
MOST_AT_ONCE = 1 << 20
"""Products of poses and machines that are kept at once: each has a dozen numbers, a hundred megabytes together."""
STATISTICS = {
    "mean": "of the average machine",
    "rms": "root mean square",
    "rss": "root sum square",
    "usual": "95 %",
    "worst": "worst case",
}
"""The statistics of a measure, and what people call them."""
MOST_NAMED_LINES = 4
"""Lines of [tolerances] that a sentence names: with more it is no longer read, and the table has all."""
LEAST_NAMED_SHARE = 0.005
"""Share of the variance below which a line of [tolerances] is not named: it would be written as 0 %."""
ROUND_OFF_SHARE = 1e-9
"""Share of an error below which a part of it is round-off."""
DRAWN_DIGITS = 3
"""Digits of errors of the tool: percentiles of drawn machines have no more."""


@former_names(sometimes="sometimes_pressed")
@dataclass(frozen=True, eq=False)
class Budget(ImmutableAnswer):
    """The error of the tool at n poses, and what it is made of.

    Attributes:
        machine: the machine as drawn.
        tolerances: lines that hold, in order.
        parts: parts that have a tolerance.
        pressed: paths of joints that the load presses to one end of their clearance, at any pose.
        sometimes_pressed: those of them that it presses at some poses only; elsewhere they are free.
        poses: poses of the list; None for another source of poses.
        question: question about the grid; None if the poses are not those of a grid.
        status: `Status` codes [n].
        measures: names of the measures: components of the twist of the tool (rx ry rz x y z), "along", "rotation",
            "position", and "parasitic ..." of a machine with fewer freedoms.
        units: unit of each measure, "rad" or "m".
        spread: statistics of each measure [n x measures]; NaN where the status is not OK.
        shares: share of each part in the variance of each measure, all poses together [measures x parts].
        freedoms: least number of independent motions that the actuators give the platform, over all poses.
        parasitic: components of the twist that no actuator moves at any pose.
        samples: number of machines that were drawn.
        exact: machines solved exactly, if they were asked for.
        allocation: tolerances of least cost, if they were asked for.
        message: the answer in sentences.
        loads_left_out: a sentence on the loads of the file that do not count; empty where all do.
    """

    machine: Machine
    tolerances: tuple[Tolerance, ...]
    parts: tuple[TolerancedPart, ...]
    pressed: tuple[str, ...]
    sometimes_pressed: tuple[str, ...]
    poses: PoseColumns | None
    question: GridQuestion | None
    status: Integers
    measures: tuple[str, ...]
    units: tuple[str, ...]
    spread: Spread
    shares: Array
    freedoms: int
    parasitic: tuple[str, ...]
    samples: int
    exact: ExactSample | None
    allocation: Allocation | None
    message: str
    loads_left_out: str = ""

    def __repr__(self) -> str:
        return f"<Budget of {self.machine.name!r}: {len(self.parts)} tolerances, {len(self.status)} poses>"

    @property
    def settled(self) -> Mask:
        """At which poses there is a result [n]."""
        return np.asarray(self.status == Status.OK)

    @property
    def leading(self) -> str:
        """The measure that contributions are ranked by: along the direction that was asked for, else the position."""
        return "along" if "along" in self.measures else "position"

    @property
    def worst_pose(self) -> int:
        """Number of the pose, from 0, at which the usual error of the leading measure is largest."""
        return int(np.nanargmax(self.spread.usual[:, self.measures.index(self.leading)]))

    @checked
    def size(self, statistic: str, measure: str) -> Array:
        """One statistic of a measure at each pose, SI [n].

        Args:
            statistic: "mean" (of the average machine), "rms" (root mean square), "rss" (mean plus root of
                the sum of squares of what each limit adds), "usual" (what 95 % of all machines keep within) or "worst".
            measure: one of `measures`.

        Raises:
            InputError: there is no such statistic or measure.
        """
        sizes = getattr(self.spread, choice(statistic, STATISTICS, "statistic"))
        return np.asarray(sizes[:, self.measures.index(choice(measure, self.measures, "measure"))])

    @checked
    def shares_by(self, key: str, measure: str = "") -> dict[str, float]:
        """Shares in the variance of a measure, the largest first; they add up to 1.

        Args:
            key: "line", "leg", "group" or "path" of the parts.
            measure: one of `measures`; the leading one if empty.

        Raises:
            InputError: there is no such key or measure.
        """
        choice(key, ("line", "leg", "group", "path"), "key")
        row = self.shares[self.measures.index(choice(measure or self.leading, self.measures, "measure"))]
        sums: dict[str, float] = {}
        for part, share in zip(self.parts, row.tolist(), strict=True):
            name = getattr(part, key) or "shared by all legs"
            sums[name] = sums.get(name, 0.0) + share
        return dict(ranking_of(sums))

    @property
    def ranking(self) -> list[int]:
        """Places of the parts, the most important for the leading measure first."""
        row = self.shares[self.measures.index(self.leading)]
        return [place for place, _ in ranking_of(dict(enumerate(row.tolist())))]


@checked
def budget(
    machine: Machine | MachineState,
    poses: Any = None,
    ranges: Sequence[str] = (),
    tolerances: Mapping[str, Any] | None = None,
    along: Sequence[float] = (),
    samples: int = 0,
    exact: int = 0,
    allocate: float | str | None = None,
    by: str = "rss",
    seed: int = 0,
    progress: Progress = silent,
) -> Budget:
    """Compute the error of the tool that tolerances allow, what it is made of, and which tolerances would cost least.

    Machines are drawn at random within their tolerances; actuators stand where the drawn machine has them. The error is
    that of the tool point and of the platform's orientation, to first order in the tolerances.

    Args:
        machine: the machine as drawn, with the tolerances of its file, or its state, as `state_of` returns it; its
            pose counts if no poses are given.
        poses: a DataFrame, a dictionary of columns, an array, a dataset or the path of a CSV file, as for `evaluate`.
        ranges: instead of poses, a grid: one axis each, "x=-2 cm:2 cm:11", coordinates of the pose only.
        tolerances: further lines as in the table [tolerances], after those of the file: {"joints": "0.05 mm"}.
        along: a direction, base axes, of any length: the error of the tool point along it is a further measure.
        samples: machines that are drawn for percentiles, rounded up to a power of 2; 0 for 131072 at a single pose and
            4096 at each of many.
        exact: machines whose equations are solved exactly, at the pose of the machine.
        allocate: wanted error of the tool point (or along the direction), m or text with a unit: gives the tolerances
            of least cost that keep it.
        by: the sum of errors that must keep it: "rss", the root of the sum of squares, or "worst", the worst case.
        seed: seed of the random machines.
        progress: receives how far the work is.

    Raises:
        InputError: no tolerances, a line that is about nothing or has no size, a bad argument, poses that cannot be
            read or of which none has a place.
    """
    _check(poses, ranges, samples, exact, by, seed)
    state = state_of(machine)
    lines = joined_tolerances(state.machine.tolerances, read_tolerances({} if tolerances is None else tolerances))
    question = grid_question(state, ranges, ["singularity_margin"]) if ranges else None
    columns = None if poses is None else given_poses(state.machine, poses)
    leaves, count = _leaves_and_count(question, columns)
    if count > MOST_BUDGET_POSES:
        raise InputError(f"there are {count:,} poses; at most {MOST_BUDGET_POSES:,} are computed: lower their number.")
    direction = np.array(unit_direction(along, "along")) if len(along) else None
    machines = _power_of_2(samples or (SAMPLES if count == 1 else FEW_SAMPLES))
    sums = _Sums(state, lines, direction, machines, seed, others=count > 1 and platform_is_loaded(state.machine))
    status = np.empty(count, dtype=np.int64)
    step = max(1, min(DRAWN_POSES_AT_ONCE, MOST_AT_ONCE // machines))
    for start in range(0, count, step):
        slab = slice(start, min(start + step, count))
        status[slab] = sums.add({path: column[slab] for path, column in leaves.items()}, slab.stop - start)
        progress(slab.stop, count)
    return _answer(sums, status, question, columns, exact, allocate, by)


def _check(poses: Any, ranges: Sequence[str], samples: int, exact: int, by: str, seed: int) -> None:
    if poses is not None and ranges:
        raise InputError("the poses come from a list or from ranges, not from both; leave one of them out.")
    if (poses is not None or ranges) and exact:
        raise InputError("exact machines are solved at the pose of the machine; leave the poses out, or exact.")
    for name, value, most in (("samples", samples, MOST_DRAWN_MACHINES), ("exact", exact, MOST_EXACT)):
        if not 0 <= value <= most:
            raise InputError(f"{name} is {shorten(value)}; give a whole number of machines from 1 to {most:,}.")
    if seed < 0:
        raise InputError(f"seed is {seed}; give a whole number from 0.")
    choice(by, ALLOCATION_RULES, "by")


def _power_of_2(count: int) -> int:
    """The least power of 2 that is not below a number: so many Sobol points are even."""
    return 1 << max(0, count - 1).bit_length()


def _leaves_and_count(question: GridQuestion | None, columns: PoseColumns | None) -> tuple[Mapping[str, Array], int]:
    """The parameters that vary, by leaf path, and the number of poses: those of a grid, of a list, or the machine's."""
    if question is not None:
        return question.grid.columns(0, question.grid.size), question.grid.size
    return ({}, 1) if columns is None else (columns.leaves, columns.count)


class _Sums:
    """Adds up the answer, a slab of poses at a time; at every pose the same machines are drawn.

    Attributes:
        state, lines, along, samples, seed: as for `budget`.
        others: as for `random_inputs`: whether joints that are free at one pose may be pressed at another.
        leading: the measure for which tolerances are allocated, as `Budget.leading`.
        components: names of the components of twists that the machine has.
        parts: parts with a tolerance; none before the first slab.
        first: the variables and the measures at the first slab with a result; None before it.
        freedoms: least number of motions that the actuators give the platform at any pose.
        parasitic: components of the twist that no actuator moves at any pose.
        pressed: whether the load presses each part, for each slab with a result [poses with a result x parts].
        spreads: for each slab, at which of its poses there are results [poses], and these; None without any.
        effects: for each slab with a result, what limits do to the leading measure, as `effects_of_limits` returns it.
        largest: the largest error of each drawn machine over all poses [machines x measures].
        variances: variances of the measures by part, all poses together [measures x parts].
    """

    def __init__(
        self,
        state: MachineState,
        lines: Mapping[str, Tolerance],
        along: Array | None,
        samples: int,
        seed: int,
        others: bool,
    ) -> None:
        """Begin without any pose."""
        self.state, self.lines, self.along = state, lines, along
        self.samples, self.seed, self.others = samples, seed, others
        self.leading = "position" if along is None else "along"
        self.parts: tuple[TolerancedPart, ...] = ()
        self.first: tuple[RandomInputs, Measures] | None = None
        self.components = state.machine.family.component_names
        self.freedoms, self.parasitic = len(self.components), self.components
        self.pressed: list[Mask] = []
        self.spreads: list[tuple[Mask, Spread | None]] = []
        self.effects: list[dict[str, Array]] = []
        self.largest: Array | float = -np.inf
        self.variances: Array | float = 0.0

    def add(self, columns: Mapping[str, Array], count: int) -> Codes:
        """Add a slab of poses, by the values of the parameters that vary; return their `Status` codes."""
        model = error_model(self.state, columns, count)
        self.parts = self.parts or toleranced_parts(self.state.machine, model.errors, self.lines)
        settled = np.asarray(model.drawn.status == Status.OK)
        spread = self._add_spread(model.at_poses(np.flatnonzero(settled))) if settled.any() else None
        self.spreads.append((settled, spread))
        return model.drawn.status

    def _add_spread(self, model: ErrorModel) -> Spread:
        """Add the poses of a model, all of which have a result, and return the statistics at them."""
        length = float(self.state.configuration.length)
        rates = _without_round_off(model.rates(), length)
        inputs = random_inputs(self.parts, rates, model.drawn.load, length, others=self.others)
        zeros = [place for place, error in enumerate(model.errors) if error.group == "zeros"]
        measures, freedoms, parasitic = measures_of(rates[:, :, zeros], self.components, self.along, length)
        self.freedoms = min(self.freedoms, freedoms)
        self.parasitic = tuple(name for name in self.parasitic if name in parasitic)
        self.pressed.append(inputs.pressed)
        self.first = self.first or (inputs, measures)
        spread, largest = spread_of(inputs, measures, inputs.machines(self.samples, self.seed))
        self.largest = np.maximum(self.largest, largest)
        self.variances = self.variances + variance_by_part(inputs, measures)
        self.effects.append(effects_of_limits(inputs, measures, self.leading))
        return spread


def _without_round_off(rates: Array, length: float) -> Array:
    """Rates without components that are round-off [n x 6 x errors], so that none of them counts as a motion."""
    sizes = np.abs(rates * np.array([length] * 3 + [1.0] * 3)[:, None])
    return np.where(sizes > NO_EFFECT * sizes.max(axis=1, keepdims=True), rates, 0.0)


def _answer(
    sums: _Sums,
    status: Integers,
    question: GridQuestion | None,
    columns: PoseColumns | None,
    exact: int,
    allocate: float | str | None,
    by: str,
) -> Budget:
    """The answer by the sums over all poses, whose `Status` codes are given; other arguments as for `budget`."""
    machine = sums.state.machine
    if sums.first is None:
        reason = Status(int(status[0]))
        where = "the pose" if len(status) == 1 else "all poses"
        raise InputError(
            f"{machine.name} has no result at {where} ({reason.phrase}): {reason.sentence} "
            f"{columns.unit_doubt if columns else ''}".rstrip()
        )
    inputs, measures = sums.first
    allocation = None
    if allocate is not None:
        wanted = positive_number(allocate, "length", "allocate, the wanted error,")
        allocation = allocation_for(sums.parts, sums.effects, wanted, by, sums.leading)
    pressed = np.concatenate(sums.pressed)
    at_any_pose = [part.path for part, at_poses in zip(sums.parts, pressed.T, strict=True) if at_poses.any()]
    at_all_poses = [part.path for part, at_poses in zip(sums.parts, pressed.T, strict=True) if at_poses.all()]
    answer = Budget(
        machine=machine,
        tolerances=tuple(sums.lines.values()),
        parts=sums.parts,
        pressed=tuple(at_any_pose),
        sometimes_pressed=tuple(path for path in at_any_pose if path not in at_all_poses),
        poses=columns,
        question=question,
        status=status,
        measures=measures.names,
        units=tuple(measures.units[name] for name in measures.names),
        spread=_joined_spread(sums, len(measures.names)),
        shares=shares(np.asarray(sums.variances)),
        freedoms=sums.freedoms,
        parasitic=sums.parasitic,
        samples=sums.samples,
        exact=exact_sample(machine, inputs, measures, _power_of_2(exact), sums.seed) if exact else None,
        allocation=allocation,
        message="",
        loads_left_out=sums.state.left_out,
    )
    return replace(answer, message=_message(answer))


def _joined_spread(sums: _Sums, size: int) -> Spread:
    """The spreads of all slabs as one, NaN where there is no result; `size` is the number of measures."""
    tables_by_statistic: dict[str, list[Array]] = {name: [] for name in STATISTICS}
    for settled, spread in sums.spreads:
        for name, tables in tables_by_statistic.items():
            table = np.full((len(settled), size), np.nan)
            if spread is not None:
                table[settled] = getattr(spread, name)
            tables.append(table)
    at_poses = {name: np.concatenate(tables) for name, tables in tables_by_statistic.items()}
    return Spread(**at_poses, everywhere=np.percentile(np.asarray(sums.largest), USUAL_PERCENT, axis=0))


def _message(answer: Budget) -> str:
    leading, pose = answer.leading, answer.worst_pose
    usual, worst = (float(answer.size(name, leading)[pose]) for name in ("usual", "worst"))
    where = "along the direction" if leading == "along" else "at the tool point"
    if not worst:
        return f"The tolerances do not move the tool {where}. {answer.loads_left_out}".strip()
    at_worst_pose = "" if len(answer.status) == 1 else f" at the worst of {int(answer.settled.sum())} poses"
    size, most = (_small_motion(answer, value, "m") for value in (usual, worst))
    sentences = [f"95 % of all machines are off by at most {size} {where}{at_worst_pose} (worst case {most})."]
    shares_of_lines = answer.shares_by("line").items()
    ranked = [f"{name} ({100.0 * share:.0f} %)" for name, share in shares_of_lines if share > LEAST_NAMED_SHARE]
    sentences.append(f"The variance comes from {', '.join(ranked[:MOST_NAMED_LINES])}.")
    if answer.freedoms < len(answer.machine.family.components):
        sentences.append(_parasitic_sentence(answer, pose))
    if answer.pressed:
        some = f" ({len(answer.sometimes_pressed)} of them at some poses only)" if answer.sometimes_pressed else ""
        sentences.append(f"The load presses {len(answer.pressed)} joints to one end of their clearance{some}.")
    return " ".join([*sentences, answer.loads_left_out]).strip()


def _parasitic_sentence(answer: Budget, pose: int) -> str:
    """Say which part of the error no correction of the actuators takes away."""
    # A planar machine has the component rz in the place of a rotation.
    rotation = "rotation" if f"{PARASITIC}rotation" in answer.measures else "rz"
    clauses = []
    for measure, verb, unit in ((rotation, "turns", "rad"), ("position", "moves", "m")):
        name = f"{PARASITIC}{measure}"
        if name in answer.measures:
            size = float(answer.size("usual", name)[pose])
            if size > ROUND_OFF_SHARE * float(answer.size("usual", measure)[pose]):
                clauses.append(f"{verb} by up to {_small_motion(answer, size, unit)}")
    lack = f"no actuator moves {' '.join(answer.parasitic)}" if answer.parasitic else "no actuator corrects all of it"
    remainder = f", and by parasitic motions the platform {' and '.join(clauses)} (95 %)" if clauses else ""
    return f"The machine has {answer.freedoms} freedoms: {lack}{remainder}."


def _small_motion(answer: Budget, value: float, unit: str) -> str:
    """A small motion in as many digits as percentiles of drawn machines have."""
    scale = answer.machine.display.deflection(unit)
    return with_unit(number(value * scale.factor, digits=DRAWN_DIGITS), scale.unit)
