"""The numbers of a machine that have tolerances, and random machines whose numbers lie within these.

A line of [tolerances] is about a group of errors, or about a path in which * stands for anything. Where two lines are
about the same number, the later one holds.

A number between limits is one variable from -1 to 1. The free motion of a joint without load is a point in a disc or a
ball, one variable for each direction. A load presses the joint to the end of its free motion: the reaction of the joint
is what the load does per unit of that motion (virtual work), and the motion goes from 0 to the clearance along it. At
poses where it has no reaction it is free.

Source: theory (50) and (51).
"""

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from kinetostat.accuracy.errors import MachineError
from kinetostat.accuracy.model import error_model
from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError
from kinetostat.spec.tolerance_table import SIGMAS, Deviation, Tolerance
from kinetostat.tolerances import LEAST_DIVISOR, NO_REACTION

ERROR_GROUPS = {
    "joints": "geometry",
    "geometry": "geometry",
    "zeros": "zeros",
    "gains": "gains",
    "clearances": "clearances",
    "compliances": "compliances",
    "shared": "shared",
}
"""Groups of errors by the names that a line may have."""
CLEARANCE_WORD = "clearance"
"""Part of the path of free motions of joints; paths with * are about these only if they have this word."""
TOLERANCE_EXAMPLES = {"length": "0.05 mm", "angle": "0.02 deg", "share": "20 um/m"}
"""A tolerance of each kind of number, for messages."""
WRITE_TOLERANCES = (
    'write for example the lines joints = ["0.05 mm", "0.02 deg"] (where joints sit, how their axes stand) and zeros = '
    '"0.02 mm" (of actuators) under [tolerances] into its file, or give --tolerance "joints=0.05 mm"'
)
MACHINES_AT_ONCE = 1 << 14
"""Machines that are made at once: with some ten variables each they fill the second level of the cache."""
LEAST_NORMAL_PROBABILITY = 1e-16
"""Probability below which no normal number is drawn, that of eight standard deviations: a point of the cube may be 0 or
1, of which the number would be infinite."""
UNIFORM_VARIANCE = 1.0 / 3.0
"""Variance of a variable that is evenly distributed between -1 and 1."""


@dataclass(frozen=True)
class TolerancedPart:
    """Numbers of a machine that may be off together: a single one, or the free motion of a joint in all directions.

    Attributes:
        errors: numbers of its errors in the error model.
        path: path of the number, as a line may name it.
        words: its name for people.
        kind: "length", "angle" or "share".
        group: group of its errors.
        leg: name of its leg; empty if legs share the number.
        line: subject of the line of [tolerances] that holds for it.
        limit: greatest deviation to both sides, SI; for a clearance, the way of the joint from its middle.
        normal: whether it is normally distributed with a limit of three standard deviations; evenly otherwise.
        cost: cost of its line.
    """

    errors: tuple[int, ...]
    path: str
    words: str
    kind: str
    group: str
    leg: str
    line: str
    limit: float
    normal: bool
    cost: float

    @property
    def free(self) -> bool:
        """Whether it is the free motion of a joint."""
        return self.group == "clearances"


def toleranced_parts(
    machine: Machine, errors: Sequence[MachineError], tolerances: Mapping[str, Tolerance]
) -> tuple[TolerancedPart, ...]:
    """Give each error the tolerance of the last line that is about it; errors without a line are exact.

    Args:
        machine: the machine, whose numbers are the nominal sizes of its fields.
        errors: errors of the model.
        tolerances: lines of [tolerances], in order.

    Raises:
        InputError: there is no line, a line is about nothing, or has no value for what it is about.
    """
    if not tolerances:
        raise InputError(f"{machine.name} has no tolerances, so that nothing can be off; {WRITE_TOLERANCES}.")
    line_of_error: dict[int, tuple[Tolerance, Deviation]] = {}
    for line in tolerances.values():
        numbers = [number for number, error in enumerate(errors) if is_about(line.about, error)]
        if not numbers:
            raise InputError(_about_nothing(machine, line, errors))
        deviations = [(number, line.of(errors[number].kind)) for number in numbers]
        with_value = {number: (line, deviation) for number, deviation in deviations if deviation is not None}
        if not with_value:
            kinds = list(dict.fromkeys(errors[number].kind for number in numbers))
            raise InputError(
                f'{machine.name}: tolerances.{line.about} is "{line.text}", but the numbers that it is about are '
                f'{" and ".join(f"{kind}s" for kind in kinds)}; write for example "{TOLERANCE_EXAMPLES[kinds[0]]}". '
                "`kinetostat budget MACHINE --list` shows every number that can move the tool."
            )
        line_of_error |= with_value
    nominal = values(machine)
    return tuple(_part(machine, errors, group, line_of_error, nominal) for group in _parts_of(errors, line_of_error))


def is_about(about: str, error: MachineError) -> bool:
    """Return whether a line is about an error: its group, its path or the beginning of it, or a path with *."""
    if about in ERROR_GROUPS:
        return error.group == ERROR_GROUPS[about]
    if error.group == "clearances" and CLEARANCE_WORD not in about:
        return False
    return _fits(about, error.path) or _fits(f"{about}.*", error.path)


def _fits(pattern: str, path: str) -> bool:
    """Return whether a path has the parts of a pattern between its stars, in this order.

    It takes linear time, whatever people write: a regular expression with many stars would not.
    """
    first, *others = pattern.split("*")
    if not others:
        return path == pattern
    if not path.startswith(first):
        return False
    place = len(first)
    for part in others[:-1]:
        place = path.find(part, place)
        if place < 0:
            return False
        place += len(part)
    return path.endswith(others[-1]) and len(path) - len(others[-1]) >= place


def _parts_of(errors: Sequence[MachineError], numbers: Iterable[int]) -> Iterator[list[int]]:
    """Give the numbers of errors with a tolerance, those of the clearance of a joint together."""
    numbers_of_part: dict[str, list[int]] = {}
    for number in sorted(numbers):
        numbers_of_part.setdefault(_path_of_part(errors[number]), []).append(number)
    yield from numbers_of_part.values()


def _path_of_part(error: MachineError) -> str:
    """Return the path of an error, of a clearance without its direction."""
    return error.path.rpartition(".")[0] if error.group == "clearances" else error.path


def _part(
    machine: Machine,
    errors: Sequence[MachineError],
    numbers: Sequence[int],
    line_of_error: Mapping[int, tuple[Tolerance, Deviation]],
    nominal: Mapping[str, object],
) -> TolerancedPart:
    """Return the part of some errors, all of which the line of the first holds for; fits need its nominal size, m."""
    error, (line, deviation) = errors[numbers[0]], line_of_error[numbers[0]]
    drawn = nominal.get(error.path, 0.0)
    size = abs(float(drawn)) if error.kind == "length" and isinstance(drawn, int | float) else 0.0
    try:
        limit = deviation.within(error.kind, size)
    except InputError as reason:
        raise InputError(f"{machine.name}: tolerances.{line.about}: {reason}") from None
    return TolerancedPart(
        errors=tuple(numbers),
        path=_path_of_part(error),
        words=error.words.partition(" along ")[0] if error.group == "clearances" else error.words,
        kind=error.kind,
        group=error.group,
        leg=error.leg,
        line=line.about,
        limit=limit,
        normal=deviation.spread == "normal",
        cost=line.cost,
    )


def _about_nothing(machine: Machine, line: Tolerance, errors: Sequence[MachineError]) -> str:
    """Write the message that a line is about nothing, with what a line may be about."""
    present = [name for name, group in ERROR_GROUPS.items() if any(error.group == group for error in errors)]
    near = difflib.get_close_matches(line.about, [*present, *(error.path for error in errors)], 1)
    hint = f'did you mean "{near[0]}"?' if near else f"groups are {', '.join(present)}."
    return (
        f"{machine.name}: tolerances.{line.about} is about nothing that this machine has; {hint} `kinetostat budget "
        "MACHINE --list` shows every path."
    )


@dataclass(frozen=True)
class RandomInputs:
    """The variables of all parts, and their effects at n poses.

    Attributes:
        parts: the parts with a tolerance.
        owner: number of the part of each variable [q].
        block: number of the block of each variable; variables of a block are coordinates of one point in a disc or
            ball [q].
        variance: variance of each variable [q].
        columns: twist of the tool when a variable is 1 [n x 6 x q].
        shift: twist of the tool when all variables are 0: joints that a load presses to one end [n x 6].
        errors: value of each error of the model when a variable is 1, at the first pose [errors x q].
        drawn: value of each error when all variables are 0, at the first pose [errors].
        pressed: whether parts are joints that a load presses at each pose [n x parts].
    """

    parts: tuple[TolerancedPart, ...]
    owner: Integers
    block: Integers
    variance: Array
    columns: Array
    shift: Array
    errors: Array
    drawn: Array
    pressed: Mask

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self.owner)

    def machines(self, count: int, seed: int) -> Iterator[Array]:
        """Give values of the variables of random machines, slab by slab [slab x q]: Sobol points.

        Args:
            count: number of machines, a power of 2.
            seed: seed of the scrambling.
        """
        points = qmc.Sobol(self.size, scramble=True, seed=seed)
        for start in range(0, count, MACHINES_AT_ONCE):
            yield self._values(points.random(min(MACHINES_AT_ONCE, count - start)))

    def _values(self, points: Array) -> Array:
        """Return values of the variables from points of the unit cube [m x q]."""
        # Variable by variable, whose values then lie beside each other.
        variables = 2.0 * np.ascontiguousarray(points.T) - 1.0
        is_normal = np.array([part.normal and not part.free for part in self.parts])
        for number in np.flatnonzero(is_normal[self.owner]):
            probabilities = np.clip(points[:, number], LEAST_NORMAL_PROBABILITY, 1.0 - LEAST_NORMAL_PROBABILITY)
            variables[number] = ndtri(probabilities) / SIGMAS
        for size in (2, 3):  # coordinates of a point in a disc, and in a ball
            blocks = np.array([block for block in self.blocks if len(block) == size])
            if len(blocks):
                variables[blocks] = _in_ball(variables[blocks])
        return variables.T

    @property
    def blocks(self) -> list[Integers]:
        """The variables of each block."""
        return [np.flatnonzero(self.block == number) for number in range(int(self.block.max(initial=-1)) + 1)]


def _in_ball(cube: Array) -> Array:
    """Return even points of the cube from -1 to 1 as even points of the disc or ball [blocks x 2 or 3 x m].

    The share of a disc within a radius grows with its square, that of a ball with its cube; heights of even points on
    a sphere are even (Archimedes).
    """
    share_within, angle = 0.5 * (cube[:, 0] + 1.0), np.pi * cube[:, 1]
    if cube.shape[1] == 2:
        radius = np.sqrt(share_within)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    radius, height = np.cbrt(share_within), cube[:, 2]
    across = radius * np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), radius * height], axis=1)


@dataclass(frozen=True)
class _Block:
    """Variables of a part that are coordinates of one point.

    Attributes:
        part: number of the part.
        variance: variance of each variable.
        columns: twist of the tool when a variable is 1 [n x 6 x variables].
        errors: value of each error of the model when a variable is 1, at the first pose [errors x variables].
    """

    part: int
    variance: float
    columns: Array
    errors: Array


def greatest_work(load: Array, length: float) -> Array:
    """The most work that loads can do per length of any motion, N [n]: a share far below it is round-off.

    Args:
        load: wrench at the tool point, N·m and N [n x 6].
        length: a characteristic length of the machine, m.
    """
    return np.asarray(np.abs(load[:, 3:]).sum(axis=1) + np.abs(load[:, :3]).sum(axis=1) / length)


def random_inputs(
    parts: Sequence[TolerancedPart],
    rates: Array,
    load: Array,
    length: float,
    others: bool = False,
) -> RandomInputs:
    """State the variables of the tolerances of a machine, and their effects at n poses.

    Args:
        parts: parts with a tolerance.
        rates: rates of the error model, SI [n x 6 x errors].
        load: wrench at the tool point, base axes, N·m and N [n x 6].
        length: a characteristic length of the machine, m.
        others: whether there are other poses, at which joints that are free here may be pressed and pressed ones free:
            then all of them have variables for both.
    """
    count, _, size = rates.shape
    work = np.einsum("nie,ni->ne", rates, load)
    reacts = np.abs(work) > NO_REACTION * greatest_work(load, length)[:, None]
    pressed = np.array([part.free & reacts[:, list(part.errors)].any(axis=1) for part in parts]).T
    shift, drawn, blocks = np.zeros((count, 6)), np.zeros(size), list[_Block]()
    for number, part in enumerate(parts):
        is_pressed = pressed[:, number]
        changes = others and part.free
        if is_pressed.any() or changes:
            blocks.append(_pressed_block(number, part, rates, work, is_pressed))
            shift += blocks[-1].columns[:, :, 0]
            drawn += blocks[-1].errors[:, 0]
        if not is_pressed.all() or changes:
            blocks.append(_unpressed_block(number, part, rates, is_pressed))
    sizes = [block.columns.shape[2] for block in blocks]
    return RandomInputs(
        parts=tuple(parts),
        owner=np.repeat([block.part for block in blocks], sizes),
        block=np.repeat(np.arange(len(blocks)), sizes),
        variance=np.repeat([block.variance for block in blocks], sizes),
        columns=np.concatenate([block.columns for block in blocks], axis=2),
        shift=shift,
        errors=np.concatenate([block.errors for block in blocks], axis=1),
        drawn=drawn,
        pressed=pressed,
    )


def _pressed_block(number: int, part: TolerancedPart, rates: Array, work: Array, is_pressed: Mask) -> _Block:
    """Return the variable of a joint that a load presses to one end of its clearance; the clearance itself varies.

    The joint stands at half of its usual clearance from its middle, and the variable is the other half.

    Args:
        number: number of the part.
        part: the joint.
        rates: rates of all errors [n x 6 x errors].
        work: work of the load on all errors [n x errors].
        is_pressed: whether the load presses the joint at the poses [n].
    """
    numbers = list(part.errors)
    sizes = np.maximum(np.linalg.norm(work[:, numbers], axis=1), LEAST_DIVISOR)
    direction = work[:, numbers] / sizes[:, None] * is_pressed[:, None]
    half_twist = 0.5 * part.limit * np.einsum("nie,ne->ni", rates[:, :, numbers], direction)
    errors = np.zeros((rates.shape[2], 1))
    errors[numbers, 0] = 0.5 * part.limit * direction[0]
    return _Block(number, UNIFORM_VARIANCE, half_twist[:, :, None], errors)


def _unpressed_block(number: int, part: TolerancedPart, rates: Array, is_pressed: Mask) -> _Block:
    """Return the variables of a part that may be anywhere within its limit; arguments as of `_pressed_block`."""
    numbers = list(part.errors)
    columns = part.limit * rates[:, :, numbers] * ~is_pressed[:, None, None]
    errors = part.limit * np.eye(rates.shape[2])[:, numbers] * (not is_pressed[0])
    # The variance of each coordinate of an even point in a ball of k dimensions is 1 / (k + 2).
    in_ball = 1.0 / (len(numbers) + 2.0)
    variance = SIGMAS**-2 if part.normal and not part.free else in_ball
    return _Block(number, variance, columns, errors)


@dataclass(frozen=True)
class PossibleErrors:
    """Every number of a machine that may be off, with the machine and its tolerances."""

    machine: Machine
    errors: tuple[MachineError, ...]


def possible_errors(machine: Machine | MachineState) -> PossibleErrors:
    """List every number of a machine that may be off.

    Args:
        machine: the machine as drawn, with or without tolerances; or its state, as `state_of` returns it.

    Raises:
        InputError: it has no place at its pose.
    """
    state = state_of(machine)
    return PossibleErrors(state.machine, error_model(state, {}, 1).errors)
