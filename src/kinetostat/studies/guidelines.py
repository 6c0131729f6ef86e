"""Design guidelines of a machine, derived: what each direction depends on, what counts as rigid, what to change.

What section 4.2 of the paper says of its machine, for any machine, at its pose and over a grid of poses. Sentences are
in `guideline_sentences`, what is printed or drawn is in `views`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.engine.batch import Progress, silent
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Points
from kinetostat.engine.responses import responses
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import (
    Element,
    diagonal_with,
    element_share,
    elements,
    rigid_from,
    stiffness_equations,
    with_links_together,
    without_rounding,
)
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.grid import grid_question
from kinetostat.studies.sensitivity import Sensitivity, notes, sensitivity

EXCESS = 0.01
"""An element counts as rigid where its compliance adds less than this share to that of the machine with it rigid."""
ROUNDING = 1e-9
"""Share of an entry of C below which an element does nothing to it: what it adds is then rounding."""
FELT = 1e-3
"""Percent per percent below which a parameter counts as doing nothing to a direction."""
MOST_POSES = 10_000
"""Poses of a grid: whole responses of all of them are kept in memory."""
AXES = "as axes of joints, which are rather a matter of tolerances: `kinetostat sensitivity` has them"
"""Why directions are no parameters of the design."""
NOT_DESIGN = ("pose", "tool", "load", "limits", "linear_density")
"""Sections whose values are no matter of the machine's design."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Roles:
    """What each element does to each direction, pose by pose; NaN where the direction is rigid, free or has no pose.

    Attributes:
        shares: of each entry of the diagonal of C, 0 to 1 [elements x components x poses].
        rigid: by which factor the stiffness of an element may be multiplied until it only just counts as rigid: from
            there on it does; infinite where nothing else yields, 0 where no softness of it matters [likewise].
        gains: by which share an entry of C falls once the element is twice as stiff [likewise].
    """

    shares: Array
    rigid: Array
    gains: Array


@dataclass(frozen=True)
class Move:
    """What one parameter of the design, or all entries of a stiffness together, does to the stiffness 1 / C_ii.

    Attributes:
        path: of the parameter.
        percents: percent by which each direction gets stiffer per percent more of the parameter; None where rigid or
            free.
        stiffer, softer: share of the poses of the grid at which it does so by more than rounding; empty without a grid.
    """

    path: str
    percents: tuple[float | None, ...]
    stiffer: tuple[float, ...] = ()
    softer: tuple[float, ...] = ()

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents."""
        return max((abs(percent) for percent in self.percents if percent is not None), default=0.0)


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
    grid = _grid(machine, ranges) if ranges else None
    answer = sensitivity(machine)
    names = machine.family.component_names
    if answer.status is not Status.OK:
        return Guidelines(machine, answer.status, answer.message, names)
    kept, response = list(machine.family.components), respond(machine)
    single = elements(response.configuration)
    found = with_links_together(single)
    whole = without_rounding(response.compliance.diagonal(), response)[kept, 0]
    moves = _moves(answer, whole > 0.0)
    everywhere, poses = None, (0, 0)
    if grid is not None:
        everywhere, poses = _over(machine, grid, found, kept, progress)
        moves = _with_signs(machine, grid, moves)
    moving = tuple(move for move in moves if _does_something(move))
    return Guidelines(
        machine,
        answer.status,
        answer.message,
        names,
        tuple(whole.tolist()),
        tuple(found),
        _roles(response, found, kept),
        _equations(response, single, kept),
        next(notes(answer)),
        moving,
        tuple(move.path for move in moves if not _does_something(move)),
        (*((path, why) for path, why in answer.skipped if _designed(machine, path)), *_axes(answer)),
        tuple(ranges),
        poses,
        everywhere,
    )


def stiffening(found: Guidelines, element: Element, factors: Array) -> Array:
    """Stiffness of each direction while an element changes, as a share of the one with the element rigid.

    Args:
        found: whose machine is taken, at its pose.
        element: whose stiffness is multiplied.
        factors: on its stiffness; of an element that is rigid, its stiffness itself (SI) [points].

    Returns:
        1 / C_ii over its limit [components x points]; 0 where nothing else yields.
    """
    kept, response = list(found.machine.family.components), respond(found.machine)
    with np.errstate(all="ignore"):
        rigid = without_rounding(diagonal_with(response, element, 0.0), response)[kept]
        return rigid / without_rounding(diagonal_with(response, element, 1.0 / factors), response)[kept]


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


def _roles(response: Response, found: Sequence[Element], kept: Sequence[int]) -> Roles:
    """The roles of all elements, at one pose or at many as arrays."""
    with np.errstate(all="ignore"):
        whole = without_rounding(response.compliance.diagonal(), response)[kept]
        whole = np.where((whole > 0.0) & np.isfinite(whole), whole, math.nan)
        shares, rigid, gains = [], [], []
        for element in found:
            part = without_rounding(element_share(response, element), response)[kept]
            ever = part / np.where(np.isfinite(whole), whole, 1.0) > ROUNDING
            factor = 1.0 / rigid_from(response, element, EXCESS)[kept]
            rigid.append(np.where(ever, np.broadcast_to(factor, ever.shape), 0.0))
            here = 0.0 if element.stiffness == math.inf else part / whole
            shares.append(np.where(here > ROUNDING, here, whole * 0.0))
            gains.append(1.0 - without_rounding(diagonal_with(response, element, 0.5), response)[kept] / whole)
    return Roles(*(np.stack(np.broadcast_arrays(*rows)) for rows in (shares, rigid, gains)))


def _equations(
    response: Response, found: Sequence[Element], kept: Sequence[int]
) -> dict[str, tuple[float, ...]] | None:
    """Coefficients in the diagonal of K by element, without those that are rounding."""
    by_element = stiffness_equations(response, found)
    if by_element is None:
        return None
    rows = {name: [float(matrix.entry(i, i)) for i in kept] for name, matrix in by_element.items()}
    most = [max(column) for column in zip(*rows.values(), strict=True)]
    return {
        name: tuple(c if c > ROUNDING * top else 0.0 for c, top in zip(row, most, strict=True))
        for name, row in rows.items()
    }


def _over(
    machine: Machine, grid: Points, found: Sequence[Element], kept: Sequence[int], progress: Progress
) -> tuple[Roles, tuple[int, int]]:
    """Roles at the poses of a grid that have an answer, and how many these are."""
    response = responses(machine, grid)
    progress(1, 2)
    good = np.broadcast_to(np.asarray(response.status) == Status.OK, (grid.size,))
    every = _roles(response, found, kept)
    progress(2, 2)
    shape = (len(found), len(kept), grid.size)
    part = [np.broadcast_to(rows, shape)[:, :, good] for rows in (every.shares, every.rigid, every.gains)]
    return Roles(*part), (int(good.sum()), grid.size)


def _moves(answer: Sensitivity, yielding: npt.NDArray[np.bool_]) -> list[Move]:
    """What the parameters of the design do to directions that yield; entries of one stiffness are moved together."""
    percents: dict[str, list[Array]] = {}
    for one in answer.influences:
        if _designed(answer.machine, one.path):
            row = np.array(
                [-p if p is not None and felt else math.nan for p, felt in zip(one.percents, yielding, strict=True)]
            )
            percents.setdefault(_together(answer.machine, one.path), []).append(row)
    rows = {path: np.sum(own, axis=0) for path, own in percents.items()}
    quiet = [_together(answer.machine, path) for path in answer.none if _designed(answer.machine, path)]
    zero = np.where(yielding, 0.0, math.nan)
    rows |= {path: zero for path in quiet if path not in rows}
    found = [Move(path, tuple(None if math.isnan(p) else float(p) for p in row)) for path, row in rows.items()]
    return sorted(found, key=lambda move: -move.greatest)


def _designed(machine: Machine, path: str) -> bool:
    """Whether a parameter is one that a designer chooses."""
    return path.split(".")[0] not in NOT_DESIGN and _kinds(machine)[path] != "direction"


def _axes(answer: Sensitivity) -> list[tuple[str, str]]:
    """The axes of joints that have an influence, and why they are left out."""
    fields = (one.path.rpartition(".")[0] for one in answer.influences if one.kind == "direction")
    return [(path, AXES) for path in dict.fromkeys(fields)]


def _kinds(machine: Machine) -> dict[str, str]:
    return {p.path: p.quantity.kind for p in parameters(machine.family)}


def _together(machine: Machine, path: str) -> str:
    """The path of a whole field where its entries are stiffnesses of springs that are one element; else the path."""
    field = path.rpartition(".")[0]
    whole = {p.path: p for p in parameters(machine.family)}.get(field)
    held = values(machine)
    alike = whole is not None and whole.quantity.stiff and len({held[leaf] for leaf in whole.leaves}) == 1
    return field if alike and field.endswith("actuator") else path


def _with_signs(machine: Machine, grid: Points, moves: Sequence[Move]) -> list[Move]:
    """The moves, with the shares of the poses at which they stiffen and soften."""
    leaves = {p.path: p.leaves for p in parameters(machine.family)}
    paths = [leaf for move in moves for leaf in leaves[move.path]]
    names = [f"compliance_{name}" for name in machine.family.component_names]
    answer = evaluate_gradient(machine, grid, names, paths)
    good = answer.status == Status.OK
    held, found = values(machine), []
    for move in moves:
        rows = [paths.index(leaf) for leaf in leaves[move.path]]
        sizes = np.array([abs(held[path]) or 1.0 for path in leaves[move.path]])
        with np.errstate(all="ignore"):
            change = -np.einsum("cpn,p->cn", answer.gradients[:, rows], sizes) / answer.values
        felt = np.where(np.abs(change) > FELT, np.sign(change), 0.0)[:, good]
        share = [tuple((felt == sign).mean(axis=1).tolist()) if good.any() else () for sign in (1.0, -1.0)]
        found.append(Move(move.path, move.percents, *share))
    return found


def _does_something(move: Move) -> bool:
    return move.greatest > FELT or any(move.stiffer) or any(move.softer)
