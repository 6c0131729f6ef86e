"""Design guidelines of a machine, derived: what each direction depends on, what counts as rigid, what to change.

What section 4.2 of the paper says of its machine, for any machine, at its pose and over a grid of poses. Sentences are
in `guideline_sentences`, what is printed or drawn is in `views`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.points import Points
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import (
    Element,
    elements,
    with_links_together,
    without_rounding,
)
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError, several
from kinetostat.studies.grid.grid import grid_question
from kinetostat.studies.guidelines.moves import Move, axes_left_out, designed, moves_at, with_signs
from kinetostat.studies.guidelines.roles import Roles, equations_of_k, roles_at, roles_over
from kinetostat.studies.sensitivity import notes, sensitivity

MOST_POSES = 10_000
"""Poses of a grid: whole responses of all of them are kept in memory."""


@dataclass(frozen=True)
class Guidelines:
    """The answer.

    Attributes:
        machine: what was asked about.
        status: of its pose; all that follows is empty unless it is OK.
        message: one readable paragraph.
        components: names of the directions.
        compliance: the diagonal of C.
        found: the elastic elements, actuators first.
        here: their roles at the pose of the file.
        equations: per element, its coefficients in the diagonal of K; None where K is no such sum.
        meaning: of the percentages in `moves`, one sentence.
        moves: what the parameters of the design do, the greatest first.
        idle: paths of parameters that do nothing to any direction, here or anywhere on the grid.
        skipped: paths of parameters without a derivative, and why.
        ranges: of the grid, as written.
        poses: how many of the grid have an answer, and how many there are.
        everywhere: roles at those that have one; None without a grid.
    """

    machine: Machine
    status: Status
    message: str
    components: tuple[str, ...]
    compliance: tuple[float, ...] = ()
    found: tuple[Element, ...] = ()
    here: Roles | None = None
    equations: dict[str, tuple[float, ...]] | None = None
    meaning: str = ""
    moves: tuple[Move, ...] = ()
    idle: tuple[str, ...] = ()
    skipped: tuple[tuple[str, str], ...] = ()
    ranges: tuple[str, ...] = ()
    poses: tuple[int, int] = (0, 0)
    everywhere: Roles | None = None

    def __repr__(self) -> str:
        return f"<Guidelines for {self.machine.name!r}: {self.status.word}, {len(self.moves)} parameters that matter>"

    @property
    def actuator(self) -> Element | None:
        """Actuators that all have one finite stiffness, to compare others with."""
        alike = (one for one in self.found if one.actuated and one.stiffness and one.stiffness < math.inf)
        return next(alike, None)


def guidelines(machine: Machine, ranges: Sequence[str] = (), progress: Progress = silent) -> Guidelines:
    """What the stiffness of a machine depends on, at its pose and over a grid.

    Args:
        machine: with its pose.
        ranges: of the grid, "FIELD=from:to:count", coordinates of the pose; none for the file's pose alone.
        progress: told how far the work is.

    Raises:
        InputError: a bad range, one that is no coordinate of the pose, or too many poses.
    """
    ranges = several(ranges)
    grid = _grid(machine, ranges) if ranges else None
    answer = sensitivity(machine)
    names = machine.family.component_names
    if answer.status is not Status.OK:
        return Guidelines(machine, answer.status, answer.message, names)
    kept, response = list(machine.family.components), respond(machine)
    single = elements(response.configuration)
    found = with_links_together(single)
    whole = without_rounding(response.compliance.diagonal(), response)[kept, 0]
    moves = moves_at(answer, whole > 0.0)
    everywhere, poses = None, (0, 0)
    if grid is not None:
        everywhere, poses = roles_over(machine, grid, found, kept, progress)
        moves = with_signs(machine, grid, moves)
    moving = tuple(move for move in moves if move.felt)
    return Guidelines(
        machine,
        answer.status,
        answer.message,
        names,
        tuple(whole.tolist()),
        tuple(found),
        roles_at(response, found, kept),
        equations_of_k(response, single, kept),
        next(notes(answer)),
        moving,
        tuple(move.path for move in moves if not move.felt),
        (*((path, why) for path, why in answer.skipped if designed(machine, path)), *axes_left_out(answer)),
        tuple(ranges),
        poses,
        everywhere,
    )


def _grid(machine: Machine, ranges: Sequence[str]) -> Points:
    question = grid_question(machine, ranges, [])
    for path in question.dims:
        if not path.startswith("pose."):
            known = ", ".join(path for path in values(machine) if path.startswith("pose."))
            raise InputError(f"{path} is no coordinate of the pose; --over takes {known}.")
    if question.grid.size > MOST_POSES:
        raise InputError(
            f"the grid has {question.grid.size:,} poses; at most {MOST_POSES:,} are allowed: lower a count."
        )
    return question.grid
