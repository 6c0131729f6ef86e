"""Independent random numbers that make a machine out of its tolerances, and what each of them does to the tool.

A number between limits is one variable from -1 to 1. The free motion of a joint without load is a point in a disc or a
ball, one variable for each direction. A load presses the joint to the end of its free motion: the reaction of the joint
is what the load does per unit of that motion (virtual work), and the motion goes from 0 to the clearance along it. At
poses where it has no reaction it is free.

Source: theory (50) and (51).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.spec.tolerance_table import SIGMAS
from kinetostat.studies.budget.toleranced import Toleranced
from kinetostat.tolerances import NO_REACTION

SLAB = 1 << 14
"""Machines that are made at once: their numbers stay in the cache."""
LEAST = 1e-16
"""Probability below which no normal number is drawn: eight standard deviations."""


@dataclass(frozen=True)
class Inputs:
    """The variables of all parts, and what they do at n poses.

    Attributes:
        parts: what has a tolerance.
        owner: number of the part of each variable [q].
        block: number of the block of each variable: coordinates of one point in a disc or ball [q].
        variance: of each variable [q].
        columns: twist of the tool when a variable is 1 [n x 6 x q].
        shift: twist of the tool when all variables are 0: joints that a load presses to one end [n x 6].
        errors: value of each error of the model when a variable is 1, at the first pose [errors x q].
        drawn: value of each error when all variables are 0, at the first pose [errors].
        pressed: which parts are joints that a load presses at each pose [n x parts].
    """

    parts: tuple[Toleranced, ...]
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
        """Values of the variables of so many machines, slab by slab [slab x q]: Sobol points.

        Args:
            count: a power of 2.
            seed: of the scrambling.
        """
        points = qmc.Sobol(self.size, scramble=True, seed=seed)
        for start in range(0, count, SLAB):
            yield self._values(points.random(min(SLAB, count - start)))

    def _values(self, points: Array) -> Array:
        """Values of the variables from points of the unit cube [m x q]."""
        # Variable by variable, whose values then lie beside each other.
        values = 2.0 * np.ascontiguousarray(points.T) - 1.0
        bent = [part.normal and not part.free for part in self.parts]
        for place in np.flatnonzero(np.array(bent)[self.owner]):
            values[place] = ndtri(np.clip(points[:, place], LEAST, 1.0 - LEAST)) / SIGMAS
        for size in (2, 3):
            blocks = [places for places in self.together if len(places) == size]
            if blocks:
                values[np.array(blocks)] = _in_ball(values[np.array(blocks)])
        return values.T

    @property
    def together(self) -> list[Integers]:
        """The variables of each block."""
        return [np.flatnonzero(self.block == number) for number in range(int(self.block.max(initial=-1)) + 1)]


def _in_ball(cube: Array) -> Array:
    """Even points of the cube from -1 to 1 as even points of the disc or ball [blocks x 2 or 3 x m]."""
    first, angle = 0.5 * (cube[:, 0] + 1.0), np.pi * cube[:, 1]
    if cube.shape[1] == 2:
        radius = np.sqrt(first)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    radius, height = np.cbrt(first), cube[:, 2]
    across = radius * np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), radius * height], axis=1)


def inputs_of(
    parts: Sequence[Toleranced],
    rates: Array,
    load: Array,
    length: float,
    others: bool = False,
) -> Inputs:
    """State what the tolerances of a machine do at n poses.

    Args:
        parts: what has a tolerance.
        rates: of the error model, SI [n x 6 x errors].
        load: wrench at the tool point, base axes, N·m and N [n x 6].
        length: a characteristic length of the machine, m.
        others: whether there are other poses, at which joints that are free here may be pressed and pressed ones free:
            then all of them have variables for both.
    """
    count, _, size = rates.shape
    work = np.einsum("nie,ni->ne", rates, load)
    # The most that any motion of a length can do: what is far below it is no reaction.
    most = np.abs(load[:, 3:]).sum(axis=1) + np.abs(load[:, :3]).sum(axis=1) / length
    owner: list[int] = []
    block: list[int] = []
    variance: list[float] = []
    columns: list[Array] = []
    errors: list[Array] = []
    shift, drawn = np.zeros((count, 6)), np.zeros(size)
    felt = np.abs(work) > NO_REACTION * most[:, None]
    pressed = np.array([part.free & felt[:, list(part.errors)].any(axis=1) for part in parts]).T
    for number, part in enumerate(parts):
        places, bears = list(part.errors), pressed[:, number]
        if bears.any() or (others and part.free):
            reaction = work[:, places]
            along = reaction / np.maximum(np.linalg.norm(reaction, axis=1), 1e-300)[:, None] * bears[:, None]
            half = 0.5 * part.limit * np.einsum("nie,ne->ni", rates[:, :, places], along)
            value = np.zeros(size)
            value[places] = 0.5 * part.limit * along[0]
            columns.append(half[:, :, None])
            errors.append(value[:, None])
            owner.append(number)
            block.append(block[-1] + 1 if block else 0)
            variance.append(1.0 / 3.0)
            shift += half
            drawn += value
        if bears.all() and not (others and part.free):
            continue
        columns.append(part.limit * rates[:, :, places] * ~bears[:, None, None])
        errors.append(part.limit * np.eye(size)[:, places] * (not bears[0]))
        owner += [number] * len(places)
        block += [block[-1] + 1 if block else 0] * len(places)
        usual = 1.0 / (len(places) + 2.0)  # of each coordinate of a point in a ball; of a single one, 1/3
        variance += [SIGMAS**-2 if part.normal and not part.free else usual] * len(places)
    return Inputs(
        tuple(parts),
        np.array(owner),
        np.array(block),
        np.array(variance),
        np.concatenate(columns, axis=2),
        shift,
        np.concatenate(errors, axis=1),
        drawn,
        pressed,
    )
