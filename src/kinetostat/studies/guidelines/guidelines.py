"""Design guidelines of a machine: what each direction depends on, what counts as rigid, what to change.

They are derived as section 4.2 of the paper does it for its machine, here for any machine, at its pose and over a grid
of poses. Sentences and plain data are in `sentences`; what is printed or drawn is in `views`.
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
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, several
from kinetostat.spec.immutable import Immutable
from kinetostat.spec.renamed import former_names
from kinetostat.studies.grid.axes import chosen_axes, grid_of
from kinetostat.studies.guidelines.moves import Move, axes_left_out, designed, moves_at, with_signs
from kinetostat.studies.guidelines.roles import Roles, equations_of_k, roles_at, roles_over
from kinetostat.studies.sensitivity import notes, sensitivity

MOST_POSES = 10_000
"""Poses of a grid: whole responses of all of them are kept in memory."""


@former_names(
    compliance="compliance_diagonal",
    found="elements",
    equations="stiffness_equations",
    moves="parameters",
    idle="without_influence",
    skipped="left_out",
)
@dataclass(frozen=True, eq=False)
class Guidelines(Immutable):
    """Design guidelines.

    Attributes:
        machine: the machine.
        status: of its pose; all that follows is empty unless it is OK.
        message: one readable paragraph.
        components: names of the directions.
        compliance_diagonal: the diagonal of C.
        elements: the elastic elements, actuators first.
        here: their roles at the pose of the file.
        stiffness_equations: per element, its coefficients in the diagonal of K; None where K is not such a sum.
        meaning: of the percentages in `parameters`, one sentence.
        parameters: what the parameters of the design do, those with the largest effect first.
        without_influence: paths of parameters that change no direction, here or anywhere on the grid.
        left_out: paths of parameters without a derivative, and why.
        ranges: of the grid, as written.
        poses: how many poses of the grid have an answer, and how many there are.
        everywhere: roles at those that have one; None without a grid.
    """

    machine: Machine
    status: Status
    message: str
    components: tuple[str, ...]
    compliance_diagonal: tuple[float, ...] = ()
    elements: tuple[Element, ...] = ()
    here: Roles | None = None
    stiffness_equations: dict[str, tuple[float, ...]] | None = None
    meaning: str = ""
    parameters: tuple[Move, ...] = ()
    without_influence: tuple[str, ...] = ()
    left_out: tuple[tuple[str, str], ...] = ()
    ranges: tuple[str, ...] = ()
    poses: tuple[int, int] = (0, 0)
    everywhere: Roles | None = None

    def __repr__(self) -> str:
        count = len(self.parameters)
        return f"<Guidelines for {self.machine.name!r}: {self.status.word}, {count} parameters that matter>"

    @property
    def actuator(self) -> Element | None:
        """The first group of actuators that all have one finite stiffness, to compare others with."""
        alike = (part for part in self.elements if part.actuated and part.stiffness and part.stiffness < math.inf)
        return next(alike, None)


@checked
def guidelines(machine: Machine, ranges: Sequence[str] = (), progress: Progress = silent) -> Guidelines:
    """Derive what the stiffness of a machine depends on, at its pose and over a grid.

    Args:
        machine: with its pose.
        ranges: of the grid, "FIELD=from:to:count", coordinates of the pose; none for the file's pose alone.
        progress: receives how far the work is.

    Raises:
        InputError: a bad range, one that is not of a coordinate of the pose, or too many poses.
    """
    ranges = several(ranges)
    grid = _grid(machine, ranges) if ranges else None
    sensitivities = sensitivity(machine)
    names = machine.family.component_names
    if sensitivities.status is not Status.OK:
        return Guidelines(machine, sensitivities.status, sensitivities.message, names)
    kept, response = list(machine.family.components), respond(machine)
    single = elements(response.configuration)
    every = with_links_together(single)
    whole = without_rounding(response.compliance.diagonal(), response)[kept, 0]
    moves = moves_at(sensitivities, whole > 0.0)
    everywhere, poses = None, (0, 0)
    if grid is not None:
        everywhere, poses = roles_over(machine, grid, every, kept, progress)
        moves = with_signs(machine, grid, moves)
    without_derivative = [pair for pair in sensitivities.without_derivative if designed(machine, pair[0])]
    return Guidelines(
        machine,
        sensitivities.status,
        sensitivities.message,
        names,
        tuple(whole.tolist()),
        tuple(every),
        roles_at(response, every, kept),
        equations_of_k(response, single, kept),
        next(notes(sensitivities)),
        tuple(move for move in moves if move.matters),
        tuple(move.path for move in moves if not move.matters),
        (*without_derivative, *axes_left_out(sensitivities)),
        tuple(ranges),
        poses,
        everywhere,
    )


def _grid(machine: Machine, ranges: Sequence[str]) -> Points:
    axes = chosen_axes(machine, ranges)
    for _, parameter in axes:
        if not parameter.path.startswith("pose."):
            known = ", ".join(path for path in values(machine) if path.startswith("pose."))
            raise InputError(f"{parameter.path} is not a coordinate of the pose; --over takes {known}.")
    grid = grid_of(axes)
    if grid.size > MOST_POSES:
        raise InputError(f"the grid has {grid.size:,} poses; at most {MOST_POSES:,} are allowed: lower a count.")
    return grid
