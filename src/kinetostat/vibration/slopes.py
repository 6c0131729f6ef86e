"""Natural frequencies over scalars from modes that are known: what derivatives need where nothing shorter is exact.

A mode is a stationary point of its mu = 1 / omega² over all motions that obey the closing of the legs. So a change of
the machine changes mu as if the mode and the forces that close the legs stayed as they are: no eigenvalue problem is
differentiated, and any machine will do. Solving for the modes is `modes`' business; here they are columns of numbers.

Source: theory (58) and what follows (63). Units are those of `equilibrium.mechanism`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, total
from kinetostat.arrays import Array
from kinetostat.equilibrium.masses import Masses
from kinetostat.equilibrium.mechanism import Mechanism, mechanism_of
from kinetostat.equilibrium.solving import with_share
from kinetostat.equilibrium.state import MachineState
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine
from kinetostat.numerics.motions import of_scalars, still
from kinetostat.tolerances import CLOSING_ROUND_OFF
from kinetostat.vibration.inertia import PartRates, energies, leg_rates, platform_rates
from kinetostat.vibration.modes import mass_matrix, motions_left_out, solved_modes, stiffness_matrix

EQUALS = 5
"""Modes beyond the last one that is wanted, among which equal ones are looked for."""


def mode_columns(machine: Machine, count: int, most: int) -> list[Array]:
    """The lowest modes of a machine with relaxed springs at n poses, as columns for `squares_of_modes`, each [n].

    Args:
        machine: at n poses: with columns of them.
        count: of poses, n.
        most: how many modes; those that a pose does not have are zero.

    Returns:
        The unit of force, then for each mode its 1 / omega², its motion of all coordinates, and the forces that close
        the legs. NaN where springs do not hold the machine.
    """
    equations = MachineState(machine, count).free_equations
    mechanism = equations.mechanism
    stiff, conditions = stiffness_matrix(equations)
    mass, closing = mass_matrix(equations), conditions.shape[1]
    held_still = np.concatenate([conditions, motions_left_out(equations, mass)], axis=1)
    columns = np.full((count, most, 1 + stiff.shape[1] + closing), np.nan)
    for part in solved_modes(equations):
        shown = min(most, part.squares.shape[1])
        squares, shapes = part.squares[:, :shown], part.shapes[:, :, :shown]
        left = stiff[part.rows] @ shapes * squares[:, None] - mass[part.rows] @ shapes
        forces = np.linalg.pinv(np.swapaxes(held_still[part.rows], 1, 2), rcond=CLOSING_ROUND_OFF) @ left
        rows = np.concatenate([squares[:, None], shapes, forces[:, :closing]], axis=1)
        columns[part.rows] = 0.0
        columns[part.rows, :shown] = np.swapaxes(rows, 1, 2)
    return [mechanism.force, *np.ascontiguousarray(columns.reshape(count, -1).T)]


@dataclass(frozen=True)
class Vibrating:
    """A machine with relaxed springs whose modes are known, over scalars.

    Attributes:
        mechanism: the machine as coordinates and masses.
        most: how many modes are known.
    """

    mechanism: Mechanism
    most: int

    @property
    def sizes(self) -> list[int]:
        """Number of coordinates of the platform, and of each leg."""
        return [self.mechanism.ways.shape[1], *(leg.size for leg in self.mechanism.legs)]

    @property
    def columns(self) -> int:
        """Number of columns that `mode_columns` makes of it."""
        return 1 + self.most * (1 + sum(self.sizes) + self.sizes[0] * len(self.mechanism.legs))

    def squares(self, columns: Sequence[Scalar]) -> list[Scalar]:
        """1 / omega² of each mode, s² [most]: exact, as their derivatives by the machine's parameters are.

        Args:
            columns: that `mode_columns` makes.
        """
        unit, *rest = columns
        size = len(rest) // self.most
        ratio = self.mechanism.force[0] / unit
        return [self._square(rest[k * size : (k + 1) * size], ratio) for k in range(self.most)]

    def _square(self, columns: Sequence[Scalar], ratio: Scalar) -> Scalar:
        """mu + phi^T M phi - mu phi^T K phi + 2 forces . what opens the legs: all but mu add up to 0."""
        mechanism, remaining = self.mechanism, iter(columns)
        square = next(remaining)
        twist, *moved = [of_scalars([next(remaining) for _ in range(size)])[0] for size in self.sizes]
        forces = [mechanism.ways @ [next(remaining) for _ in range(self.sizes[0])] for _ in mechanism.legs]
        platform = mechanism.ways @ twist
        kinetic = energy_of(
            mechanism.platform, platform_rates(mechanism.platform, still(1)), platform, mechanism.length
        )
        strain, open_by = 0.0, 0.0
        amounts = np.zeros((1, len(mechanism.actuators) + mechanism.growth.shape[1]))
        for leg, motion, force in zip(mechanism.legs, moved, forces, strict=True):
            placed = leg.chain.place(np.zeros((1, leg.size)).astype(object), amounts.astype(object))
            kinetic = kinetic + energy_of(leg.masses, leg_rates(leg, placed), motion, mechanism.length)
            kinetic = kinetic + mechanism.length[0] * total(list(leg.rotors[0] * motion * motion))
            strain = strain + total(list(leg.stiffness[0] * motion * motion))
            ends = placed.screws[0].T @ (leg.chain.follows @ motion)
            open_by = open_by + total(list(force * (ends - platform)))
        return square + ratio * (kinetic - square * strain) + 2.0 * open_by


def energy_of(masses: Masses, rates: Sequence[PartRates], motion: Array, length: Array) -> Scalar:
    """Twice the kinetic energy of some masses in a motion of their coordinates."""
    moving = [
        replace(part, moving=(part.moving @ motion)[..., None], turning=(part.turning @ motion)[..., None])
        for part in rates
    ]
    return total([matrix[0, 0, 0] for _, matrix in energies(masses, moving, length)])


def vibrating(machine: Machine, response: Response, joints: Joints | None, most: int) -> Vibrating:
    """A machine with numbers of any kind, whose modes will be known.

    Args:
        machine: with its masses.
        response: the response of the machine at its pose.
        joints: coordinates that close its legs, if it is written leg by leg.
        most: how many modes.
    """
    return Vibrating(with_share(mechanism_of(machine, response.configuration, joints, None), 0.0), most)
