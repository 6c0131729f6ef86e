"""What the parameters of a design do to the stiffness of each direction, at a pose and over a grid of poses."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Array, Points
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.sensitivity import Sensitivity, greatest_of

FELT = 1e-3
"""Percent per percent below which a parameter counts as doing nothing to a direction."""
AXES = "as axes of joints, which are rather a matter of tolerances: `kinetostat sensitivity` has them"
"""Why directions are no parameters of the design."""
NOT_DESIGN = ("pose", "tool", "load", "limits", "linear_density")
"""Sections whose values are no matter of the machine's design."""


@dataclass(frozen=True)
class Move:
    """What one parameter of the design, or all entries of a stiffness together, does to the stiffness 1 / C_ii.

    Attributes:
        path: of the parameter.
        percents: percent by which each direction gets stiffer per percent more of the parameter, of an angle per 0.01
            rad; None where rigid or free.
        stiffer, softer: share of the poses of the grid at which it does so by more than rounding; empty without a grid.
        turning: whether the parameter is an angle.
    """

    path: str
    percents: tuple[float | None, ...]
    stiffer: tuple[float, ...] = ()
    softer: tuple[float, ...] = ()
    turning: bool = False

    @property
    def felt(self) -> bool:
        """Whether it does anything, here or anywhere on the grid."""
        return self.greatest > FELT or any(self.stiffer) or any(self.softer)

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents."""
        return greatest_of(self.percents)


def moves_at(answer: Sensitivity, yielding: npt.NDArray[np.bool_]) -> list[Move]:
    """What the parameters of the design do, the greatest first; entries of one actuator stiffness move together.

    Args:
        answer: sensitivities of the diagonal of C.
        yielding: which directions yield at all.
    """
    percents: dict[str, list[Array]] = {}
    for one in answer.influences:
        if designed(answer.machine, one.path):
            row = np.where(yielding, [math.nan if p is None else -p for p in one.percents], math.nan)
            percents.setdefault(_together(answer.machine, one.path), []).append(row)
    rows = {path: np.sum(own, axis=0) for path, own in percents.items()}
    quiet = [_together(answer.machine, path) for path in answer.none if designed(answer.machine, path)]
    zero = np.where(yielding, 0.0, math.nan)
    rows |= {path: zero for path in quiet if path not in rows}
    kinds = _kinds(answer.machine)
    found = [
        Move(path, tuple(None if math.isnan(p) else float(p) for p in row), turning=kinds[path] == "angle")
        for path, row in rows.items()
    ]
    return sorted(found, key=lambda move: -move.greatest)


def designed(machine: Machine, path: str) -> bool:
    """Whether a parameter is one that a designer chooses."""
    return path.split(".")[0] not in NOT_DESIGN and _kinds(machine)[path] != "direction"


def axes_left_out(answer: Sensitivity) -> list[tuple[str, str]]:
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


def with_signs(machine: Machine, grid: Points, moves: Sequence[Move]) -> list[Move]:
    """The moves, with the shares of the poses of a grid at which they stiffen and soften."""
    leaves = {p.path: p.leaves for p in parameters(machine.family)}
    paths = [leaf for move in moves for leaf in leaves[move.path]]
    names = [f"compliance_{name}" for name in machine.family.component_names]
    answer = evaluate_gradient(machine, grid, names, paths)
    good = answer.status == Status.OK
    if not good.any():
        return list(moves)
    held, found = values(machine), []
    for move in moves:
        rows = [paths.index(leaf) for leaf in leaves[move.path]]
        sizes = np.array([1.0 if move.turning else abs(held[path]) or 1.0 for path in leaves[move.path]])
        with np.errstate(all="ignore"):
            change = -np.einsum("cpn,p->cn", answer.gradients[:, rows], sizes) / answer.values
        felt = np.where(np.abs(change) > FELT, np.sign(change), 0.0)[:, good]
        stiffer, softer = (tuple((felt == sign).mean(axis=1).tolist()) for sign in (1.0, -1.0))
        found.append(replace(move, stiffer=stiffer, softer=softer))
    return found
