"""Errors of a machine that the lines of [tolerances] are about, each with its limit. Nothing is solved here.

A line is about a group of errors, or about a path in which * stands for anything. Where two lines are about the same
number, the later one holds.
"""

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from kinetostat.accuracy.errors import MachineError
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError
from kinetostat.spec.tolerance_table import Deviation, Tolerance

GROUPS = {
    "joints": "geometry",
    "geometry": "geometry",
    "zeros": "zeros",
    "gains": "gains",
    "clearances": "clearances",
    "compliances": "compliances",
    "shared": "shared",
}
"""Groups of errors by the names that a line may have."""
CLEARANCE = "clearance"
"""Part of the path of free motions of joints; paths with * are about these only where they name it."""
EXAMPLES = {"length": "0.05 mm", "angle": "0.02 deg", "ratio": "20 um/m"}
"""A tolerance of each kind of number, for messages."""
WRITE = (
    'write for example the lines joints = ["0.05 mm", "0.02 deg"] (where joints sit, how their axes stand) and zeros = '
    '"0.02 mm" (of actuators) under [tolerances] into its file, or give --tolerance "joints=0.05 mm"'
)


@dataclass(frozen=True)
class Toleranced:
    """Numbers of a machine that may be off together: a single one, or the free motion of a joint in all directions.

    Attributes:
        errors: their places in the error model.
        path: path of the number, as a line may name it.
        words: for people.
        kind: "length", "angle" or "ratio".
        group: of the errors.
        leg: name of its leg; empty of what legs share.
        line: what the line is about that holds for it.
        limit: plus and minus, SI; of a clearance, how far the joint may move from its middle.
        normal: whether it is normally distributed, the limit being three standard deviations; else evenly.
        cost: of its line.
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


def toleranced(
    machine: Machine, errors: Sequence[MachineError], tolerances: Mapping[str, Tolerance]
) -> tuple[Toleranced, ...]:
    """Give each error the tolerance of the last line that is about it; errors without a line are exact.

    Args:
        machine: whose numbers are the nominal sizes of its fields.
        errors: of the model.
        tolerances: lines, in order.

    Raises:
        InputError: there is no line, a line is about nothing, or has no value for what it is about.
    """
    if not tolerances:
        raise InputError(f"{machine.name} has no tolerances, so that nothing can be off; {WRITE}.")
    kept: dict[int, tuple[Tolerance, Deviation]] = {}
    for line in tolerances.values():
        places = [place for place, error in enumerate(errors) if is_about(line.about, error)]
        if not places:
            raise InputError(_unknown(machine, line, errors))
        fitting = [(place, line.of(errors[place].kind)) for place in places]
        known = {place: (line, deviation) for place, deviation in fitting if deviation is not None}
        if not known:
            kinds = list(dict.fromkeys(errors[place].kind for place in places))
            raise InputError(
                f'{machine.name}: tolerances.{line.about} is "{line.text}", but the numbers that it is about are '
                f'{" and ".join(map(_plural, kinds))}; write for example "{EXAMPLES[kinds[0]]}". '
                "`kinetostat budget MACHINE --list` shows every number that can move the tool."
            )
        kept = {**kept, **known}
    sizes = values(machine)
    return tuple(_toleranced(machine, errors, group, kept, sizes) for group in _together(errors, kept))


def is_about(about: str, error: MachineError) -> bool:
    """Whether a line is about an error: its group, its path or the beginning of it, or a path with *."""
    if about in GROUPS:
        return error.group == GROUPS[about]
    if error.group == "clearances" and CLEARANCE not in about:
        return False
    return _fits(about, error.path) or _fits(f"{about}.*", error.path)


def _fits(pattern: str, path: str) -> bool:
    """Whether a path has the parts of a pattern between its stars, in this order; in linear time, whatever they are."""
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


def _together(errors: Sequence[MachineError], known: Iterable[int]) -> Iterator[list[int]]:
    """Places of errors with a tolerance; those of the clearance of a joint together."""
    joints: dict[str, list[int]] = {}
    for place in sorted(known):
        error = errors[place]
        joints.setdefault(_joint(error) if error.group == "clearances" else error.path, []).append(place)
    yield from joints.values()


def _joint(error: MachineError) -> str:
    """The path of a clearance without its direction."""
    return error.path.rpartition(".")[0]


def _toleranced(
    machine: Machine,
    errors: Sequence[MachineError],
    places: Sequence[int],
    known: Mapping[int, tuple[Tolerance, Deviation]],
    sizes: Mapping[str, object],
) -> Toleranced:
    error, (line, deviation) = errors[places[0]], known[places[0]]
    free = error.group == "clearances"
    nominal = sizes.get(error.path, 0.0)
    size = abs(float(nominal)) if error.kind == "length" and isinstance(nominal, int | float) else 0.0
    try:
        limit = deviation.within(error.kind, size)
    except InputError as reason:
        raise InputError(f"{machine.name}: tolerances.{line.about}: {reason}") from None
    return Toleranced(
        tuple(places),
        _joint(error) if free else error.path,
        error.words.partition(" along ")[0] if free else error.words,
        error.kind,
        error.group,
        error.leg,
        line.about,
        limit,
        deviation.spread == "normal",
        line.cost,
    )


def _plural(kind: str) -> str:
    return f"{kind}s"


def _unknown(machine: Machine, line: Tolerance, errors: Sequence[MachineError]) -> str:
    """Say that a line is about nothing, and what there is."""
    present = [name for name, group in GROUPS.items() if any(error.group == group for error in errors)]
    near = difflib.get_close_matches(line.about, [*present, *(error.path for error in errors)], 1)
    hint = f'did you mean "{near[0]}"?' if near else f"groups are {', '.join(present)}."
    return (
        f"{machine.name}: tolerances.{line.about} is about nothing that this machine has; {hint} `kinetostat budget "
        "MACHINE --list` shows every path."
    )
