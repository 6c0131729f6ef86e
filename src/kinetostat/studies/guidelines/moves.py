"""Effect of the parameters of a design on the stiffness of each direction, at a pose and over a grid of poses."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Points
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.sensitivity import Sensitivity, greatest_of, measure_of, relative_sensitivity

FELT = 1e-3
"""Percent per percent below which a parameter counts as without effect on a direction."""
AXES = "as axes of joints, whose errors are a matter of tolerances: `kinetostat sensitivity` shows them"
"""Why directions are no parameters of the design."""
NOT_DESIGN = ("pose", "tool", "load", "limits", "linear_density")
"""Tables of a machine file whose values are not part of the design."""


@dataclass(frozen=True)
class Move:
    """What one parameter of the design, or all entries of a stiffness together, does to the stiffness 1 / C_ii.

    Attributes:
        path: of the parameter.
        percents: percent by which each direction gets stiffer per percent more of the parameter, of an angle per 0.01
            rad; None where rigid or free.
        stiffer, softer: share of the poses of the grid at which it does so by more than round-off; empty
            without a grid.
        turning: whether the parameter is an angle.
    """

    path: str
    percents: tuple[float | None, ...]
    stiffer: tuple[float, ...] = ()
    softer: tuple[float, ...] = ()
    turning: bool = False

    @property
    def matters(self) -> bool:
        """Whether it changes any direction, here or anywhere on the grid."""
        return self.greatest > FELT or any(self.stiffer) or any(self.softer)

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents."""
        return greatest_of(self.percents)


def moves_at(sensitivities: Sensitivity, compliant: Mask) -> list[Move]:
    """List what the parameters of the design do, the largest effect first; entries of one stiffness move together.

    Args:
        sensitivities: of the diagonal of C.
        compliant: which directions are neither rigid nor free.
    """
    machine = sensitivities.machine
    entries: dict[str, list[Array]] = {}
    for parameter in sensitivities.parameters:
        if designed(machine, parameter.path):
            row = np.where(compliant, [math.nan if p is None else -p for p in parameter.percents], math.nan)
            entries.setdefault(_together(machine, parameter.path), []).append(row)
    rows = {path: np.sum(parts, axis=0) for path, parts in entries.items()}
    quiet = [_together(machine, path) for path in sensitivities.without_influence if designed(machine, path)]
    zero = np.where(compliant, 0.0, math.nan)
    rows |= {path: zero for path in quiet if path not in rows}
    kinds = _kinds(machine)
    moves = [
        Move(path, tuple(None if math.isnan(p) else float(p) for p in row), turning=kinds[path] == "angle")
        for path, row in rows.items()
    ]
    return sorted(moves, key=lambda move: -move.greatest)


def designed(machine: Machine, path: str) -> bool:
    """Whether a parameter is one that a designer chooses."""
    return path.split(".")[0] not in NOT_DESIGN and _kinds(machine)[path] != "direction"


def axes_left_out(sensitivities: Sensitivity) -> list[tuple[str, str]]:
    """The axes of joints that have an influence, and why they are left out."""
    axes = (p.path.rpartition(".")[0] for p in sensitivities.parameters if p.kind == "direction")
    return [(path, AXES) for path in dict.fromkeys(axes)]


def _kinds(machine: Machine) -> dict[str, str]:
    return {p.path: p.quantity.kind for p in parameters(machine.family)}


def _together(machine: Machine, path: str) -> str:
    """The path of a whole field where its entries are stiffnesses of springs that are one element; else the path."""
    field = path.rpartition(".")[0]
    whole = {p.path: p for p in parameters(machine.family)}.get(field)
    here = values(machine)
    if whole is None or not (whole.quantity.stiff and whole.quantity.per_leg):
        return path
    return field if len({here[leaf] for leaf in whole.leaves}) == 1 else path


def with_signs(machine: Machine, grid: Points, moves: Sequence[Move]) -> list[Move]:
    """Add to each move at which share of the poses of a grid it stiffens and softens each direction."""
    leaves = {p.path: p.leaves for p in parameters(machine.family)}
    paths = [leaf for move in moves for leaf in leaves[move.path]]
    names = [f"compliance_{name}" for name in machine.family.component_names]
    answer = evaluate_gradient(machine, grid, names, paths)
    good = answer.status == Status.OK
    if not good.any():
        return list(moves)
    length, here, kinds = float(respond(machine).configuration.length), values(machine), _kinds(machine)
    signed = []
    for move in moves:
        rows = [paths.index(leaf) for leaf in leaves[move.path]]
        sizes = np.array([measure_of(kinds[leaf], here[leaf], length)[0] for leaf in leaves[move.path]])
        percents = relative_sensitivity(answer.gradients[:, rows], sizes[:, None], answer.values[:, None])
        change = -np.nansum(percents, axis=1)
        sign = np.where(np.abs(change) > FELT, np.sign(change), 0.0)[:, good]
        stiffer, softer = (tuple((sign == wanted).mean(axis=1).tolist()) for wanted in (1.0, -1.0))
        signed.append(replace(move, stiffer=stiffer, softer=softer))
    return signed
