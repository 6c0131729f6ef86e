"""Natural frequencies and load factor of a machine whose legs close loops, from the deflections of its springs.

The unknowns y are the deflections of all springs, times the roots of their stiffnesses, so that the springs by
themselves have the stiffness matrix 1. They determine how the platform moves, and how the coordinates of each leg
follow; deflections that would open a leg are projected out. Modes are found outside of this file, by a loop over points
or by a library. Here they are given numbers: what is computed of a mode is stationary in it, so that only the squares
of its errors count.

Source: theory (44), (58) and (63). Units are those of `equilibrium.mechanism`.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, sqrt, total, where
from kinetostat.algebra.solve import Row, right_inverse
from kinetostat.arrays import Array
from kinetostat.equilibrium.cut import Cut, cut
from kinetostat.equilibrium.legwise import (
    CondensedLeg,
    LegwiseTangent,
    array_of,
    block_diagonal,
    product,
    symmetric_product,
)
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.solving import with_share
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.quantities import QUANTITIES, MapQuantity
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine
from kinetostat.numerics.motions import of_scalars
from kinetostat.tolerances import SURELY_MORE, UNRESISTED
from kinetostat.vibration.inertia import leg_rates, mass_matrices, platform_inertia, twice_kinetic_energy
from kinetostat.vibration.scalar_frequencies import SPARE_MODES, platform_alone

Modal: TypeAlias = Literal["free", "loaded", "factor"]
"""Numbers that follow from modes: frequencies with relaxed springs, those at rest under loads, and the load factor."""


@dataclass(frozen=True)
class SpringSizes:
    """Sizes of the matrices that `SpringMotions.parts` gives, and the modes that follow from them.

    Attributes:
        ways: number of motions that the platform has.
        springs: number of springs of all legs and rods.
        conditions: number of combinations of deflections that would open a leg.
        legs: number of springs of each leg; those of rods come before them.
    """

    ways: int
    springs: int
    conditions: int
    legs: tuple[int, ...] = ()

    def matrices(self, parts: Array) -> tuple[Array, Array, Array]:
        """The matrices of n states over deflections that keep all legs closed, each [n x springs x springs].

        Args:
            parts: results of `SpringMotions.parts` [entries x n].

        Returns:
            The projection Q onto these deflections, the mass Q M Q, and the stiffness Q (K - 1) Q without the springs'.
        """
        over_ways, over_conditions = self.ways * self.springs, self.conditions * self.springs
        entries = self.springs * (self.springs + 1) // 2
        ends = np.cumsum([over_ways] * 3 + [over_conditions] * 2 + [entries])
        twists, mixed_mass, mixed_stiffness, conditions, inverse, mass, stiffness = np.split(parts.T, ends, axis=1)
        twists, mixed_mass, mixed_stiffness, conditions = (
            rows.reshape(len(rows), -1, self.springs) for rows in (twists, mixed_mass, mixed_stiffness, conditions)
        )
        projection = np.eye(self.springs) - inverse.reshape(len(inverse), self.springs, -1) @ conditions
        projected = []
        for mixed, triangle in ((mixed_mass, mass), (mixed_stiffness, stiffness)):
            product_with_twists = twists.mT @ mixed
            whole = product_with_twists + product_with_twists.mT + self._from_upper(triangle)
            projected.append(projection @ whole @ projection)
        return projection, projected[0], projected[1]

    def _from_upper(self, rows: Array) -> Array:
        """Return symmetric matrices [n x springs x springs] from their upper triangles, row by row [n x entries]."""
        result = np.zeros((len(rows), self.springs, self.springs))
        i, j = np.triu_indices(self.springs)
        result[:, i, j] = result[:, j, i] = rows
        return result

    def modes(self, parts: Array, count: int, massive: bool = True) -> Array:
        """Find the lowest modes of n states, those of the least frequency first, or those of the least stiffness.

        Args:
            parts: results of `SpringMotions.parts` [entries x n].
            count: number of modes; those that a machine does not have are zero.
            massive: whether masses count; without them, modes are those of the least stiffness.

        Returns:
            The modes [n x count x springs]; NaN where springs and loads do not hold the machine.
        """
        projection, mass, stiffness = self.matrices(parts)
        result = np.full((len(mass), count, self.springs), np.nan)
        finite = np.flatnonzero(np.isfinite(mass).all(axis=(1, 2)) & np.isfinite(stiffness).all(axis=(1, 2)))
        sizes, axes = np.linalg.eigh(np.eye(self.springs) + stiffness[finite])
        stable = sizes[:, 0] > 0.0
        rows, sizes, axes = finite[stable], sizes[stable], axes[stable]
        # In the coordinates of these factors the stiffness is 1, so that an ordinary eigenvalue problem is left.
        factors = axes / np.sqrt(sizes)[:, None]
        reduced = factors.mT @ (mass if massive else projection)[rows] @ factors
        shapes = factors @ np.linalg.eigh(reduced)[1][:, :, ::-1]
        present = min(count, self.springs - self.conditions)
        result[rows] = 0.0
        result[rows, :present] = shapes.mT[:, :present]
        return result


def spring_sizes(machine: Cut) -> SpringSizes:
    """Count the springs and conditions of a machine with its loops cut."""
    ways = machine.mechanism.ways.shape[1]
    joints = [leg.springs.count(None) for leg in machine.legs]
    legs = tuple(len(leg.springs) - count for leg, count in zip(machine.legs, joints, strict=True))
    conditions = len(machine.rods) + sum(ways - count for count in joints) - ways
    return SpringSizes(ways, len(machine.rods) + sum(legs), conditions, legs)


def springs_follow_ways(machine: Cut) -> bool:
    """Return whether all springs of legs deflect in motions that the machine has; those of a planar one may not."""
    outside = np.eye(6) - machine.mechanism.ways @ machine.mechanism.ways.T
    return all(not (leg.chain.twists.astype(float) @ outside).any() for leg in machine.legs)


class SpringMotions:
    """The motions of a machine at some coordinates, over the deflections of its springs.

    Attributes:
        size: number of springs.
        sure: whether the conditions of closed legs are surely independent.
    """

    def __init__(self, machine: Cut, coordinates: Row) -> None:
        """Place the machine.

        Args:
            machine: the machine with its loops cut, of which legs close some.
            coordinates: as of `LegwiseTangent`.
        """
        tangent = LegwiseTangent(machine, coordinates)
        self._machine, self._tangent = machine, tangent
        # Of each leg, the deflections of its springs per unit of y: 1 / sqrt(k).
        self._deflections = [
            of_scalars([1.0 / sqrt(stiffness) for stiffness in leg.terms.carrying[0, leg.elastic]])[0]
            for leg in tangent.legs
        ]
        blocks = [array_of([[sqrt(rod.softness)]], 1, 1) for rod in machine.rods]
        blocks += [leg.spring_loads * scale for leg, scale in zip(tangent.legs, self._deflections, strict=True)]
        openings = block_diagonal(blocks)  # of the cuts along their lines, per unit of y
        self.size = openings.shape[1]
        ways, lines = machine.mechanism.ways.astype(object), len(tangent.lines)
        inverse, internal, _ = right_inverse(tangent.lines.T.tolist())
        count = len(internal)
        self._twists = product(array_of(inverse, lines, ways.shape[1]).T, openings)
        self._conditions = product(array_of(internal, count, lines), openings)
        self.sure: Scalar = True
        self._inverse = array_of([], self.size, 0)
        if count:
            solution, _, margin = right_inverse(self._conditions.tolist())
            self._inverse, self.sure = array_of(solution, self.size, count), margin > SURELY_MORE
        self._inertia = self._platform_inertia(ways)

    def _platform_inertia(self, ways: Array) -> Array:
        """Return the inertia of the platform with the rotors of all rods, over its motions [ways x ways]."""
        mechanism, tangent = self._machine.mechanism, self._tangent
        inertia = platform_inertia(mechanism.platform, tangent.platform, mechanism.length)[0]
        for rod, pull in zip(self._machine.rods, tangent.pulls, strict=True):
            if not is_zero(rod.rotor):
                line = np.array([part * (1.0 / pull.length) for part in pull.line], dtype=object)
                inertia = inertia + np.outer(line, line) * (rod.rotor * mechanism.length[0])
        return np.asarray(ways.T @ inertia @ ways)

    def parts(self) -> list[Scalar]:
        """Return the parts of the mass M and the stiffness K over y, row by row, for `SpringSizes.matrices`.

        With the twists T y of the platform, M is T^T H + H^T T + D and K is 1 + T^T F + F^T T + E, of D and E the upper
        triangles. Legs stay closed where A y = 0.

        Returns:
            T, H, F [ways x springs], A [conditions x springs], A+ [springs x conditions], D, E.
        """
        mixed_mass, mass = self._mass_over_springs()
        mixed_stiffness, stiffness = self._stiffness_over_springs()
        rows = [self._twists, mixed_mass, mixed_stiffness, self._conditions, self._inverse]
        return [entry for row in rows for entry in row.ravel().tolist()] + _triangle(mass) + _triangle(stiffness)

    def pencil(self, what: Modal) -> list[Scalar]:
        """Return the parts of which eigenvalues are found, in the order of `engine.eigenvalues`.

        Args:
            what: natural frequencies, of which eigenvalues are 1 / omega², with relaxed springs or at rest; or the load
                factor, of which they are the reciprocal.

        Returns:
            T, H, A and D, and F and E behind them at rest; for the load factor -F and -E in the place of H and D. Of D
            and E, the upper triangle of each leg, which are all that is not zero.
        """
        mixed, form = self._stiffness_over_springs() if what == "factor" else self._mass_over_springs()
        if what == "factor":
            mixed, form = -mixed, -form
        rows = [self._twists, mixed, self._conditions]
        result = [entry for row in rows for entry in row.ravel().tolist()] + self._triangles(form)
        if what == "loaded":
            mixed, form = self._stiffness_over_springs()
            result += mixed.ravel().tolist() + self._triangles(form)
        return result

    def _triangles(self, matrix: Array) -> list[Scalar]:
        """Return the upper triangles of all legs."""
        ends = np.cumsum([len(self._machine.rods), *(len(scale) for scale in self._deflections)]).tolist()
        return [entry for first, last in pairwise(ends) for entry in _triangle(matrix[first:last, first:last])]

    def _mass_over_springs(self) -> tuple[Array, Array]:
        return self._form_over_springs(self._inertia, self._leg_inertias())

    def _stiffness_over_springs(self) -> tuple[Array, Array]:
        return self._form_over_springs(self._tangent.turning, self._leg_stiffnesses())

    def _leg_inertias(self) -> Iterator[Array]:
        """Give the inertia of each leg over its coordinates."""
        length = self._machine.mechanism.length
        for leg, elastic in zip(self._tangent.legs, self._machine.legs, strict=True):
            matrix = np.diag(elastic.rotors[0].astype(object) * length[0])
            for _, part in mass_matrices(elastic.masses, leg_rates(elastic, leg.placed), length):
                matrix = matrix + part[0]
            yield matrix

    def _leg_stiffnesses(self) -> Iterator[Array]:
        """Give the stiffness of each leg over its coordinates that comes from wrenches which turn with its parts."""
        return (leg.terms.geometric[0].astype(object) for leg in self._tangent.legs)

    def _form_over_springs(self, platform: Array, legs: Iterable[Array]) -> tuple[Array, Array]:
        """Write a quadratic form of all motions over y: the factor of its mixed part, and the part that has no twist.

        Args:
            platform: matrix of the form over the motions of the platform [ways x ways].
            legs: its matrix over the coordinates of each leg.

        Returns:
            X [ways x springs] and Z [springs x springs] of y^T (T^T X + X^T T + Z) y.
        """
        mixed, without_twist = [], []
        for matrix, leg, scale in zip(legs, self._tangent.legs, self._deflections, strict=True):
            by_twist, by_springs = self._leg_motion(leg, scale)
            loads = product(matrix, by_springs)
            platform = platform + symmetric_product(by_twist.T, product(matrix, by_twist))
            mixed.append(product(by_twist.T, loads))
            without_twist.append(symmetric_product(by_springs.T, loads))
        count = len(self._machine.rods)  # rods have no coordinates of their own
        of_platform = 0.5 * product(0.5 * (platform + platform.T), self._twists)
        of_legs = np.concatenate([array_of([], len(platform), count), *mixed], axis=1)
        return of_platform + of_legs, block_diagonal([array_of([], count, count), *without_twist])

    @staticmethod
    def _leg_motion(leg: CondensedLeg, scale: Array) -> tuple[Array, Array]:
        """Return the rates of a leg's coordinates by the twist of the platform, and by the unknowns of its springs."""
        size = len(leg.elastic) + len(leg.passive)
        by_twist = np.full((size, leg.wrenches.shape[1]), 0.0, dtype=object)
        by_springs = np.full((size, len(leg.elastic)), 0.0, dtype=object)
        by_twist[leg.passive] = leg.passive_by_twist
        by_springs[leg.passive] = -(leg.passive_by_springs * scale)
        for place, number in enumerate(leg.elastic):
            by_springs[number, place] = scale[place]
        return by_twist, by_springs

    def square(self, mode: Sequence[Scalar]) -> Scalar:
        """Return 1 / omega² of a mode, s²: its kinetic energy over its elastic one, at omega = 1."""
        twist, leg_motions, unknowns = self._motion(mode)
        machine, tangent, length = self._machine, self._tangent, self._machine.mechanism.length
        kinetic = twist @ (self._inertia @ twist)
        for leg, elastic, motion in zip(tangent.legs, machine.legs, leg_motions, strict=True):
            kinetic = kinetic + twice_kinetic_energy(elastic.masses, leg_rates(elastic, leg.placed), motion, length)
            kinetic = kinetic + length[0] * total(list(elastic.rotors[0] * motion * motion))
        return kinetic / (unknowns @ unknowns + self._work_of_turning(twist, leg_motions))

    def factor(self, mode: Sequence[Scalar]) -> Scalar:
        """Return the factor by which loads may grow until the machine gives way in a mode; else infinite."""
        twist, leg_motions, unknowns = self._motion(mode)
        share = -(self._work_of_turning(twist, leg_motions) / (unknowns @ unknowns))
        grows = share > UNRESISTED
        return where(grows, 1.0 / where(grows, share, 1.0), math.inf)

    def _motion(self, mode: Sequence[Scalar]) -> tuple[Array, list[Array], Array]:
        """Return the twist of the platform in a mode, motions of legs' coordinates, and y that keeps legs closed."""
        unknowns = of_scalars([*mode])[0]
        if len(self._conditions):
            unknowns = unknowns - self._inverse @ (self._conditions @ unknowns)
        twist, start, leg_motions = self._twists @ unknowns, len(self._machine.rods), []
        for leg, scale in zip(self._tangent.legs, self._deflections, strict=True):
            by_twist, by_springs = self._leg_motion(leg, scale)
            leg_motions.append(product(by_twist, twist) + product(by_springs, unknowns[start : start + len(scale)]))
            start += len(scale)
        return twist, leg_motions, unknowns

    def _work_of_turning(self, twist: Array, leg_motions: Sequence[Array]) -> Scalar:
        """Return twice the work in a mode of loads and wrenches, which turn with the parts that they act on."""
        work = twist @ (self._tangent.turning @ twist)
        for leg, motion in zip(self._tangent.legs, leg_motions, strict=True):
            work = work + motion @ (leg.terms.geometric[0].astype(object) @ motion)
        return work


def _triangle(matrix: Array) -> list[Scalar]:
    """Return the upper triangle of a symmetric matrix, row by row."""
    return [matrix[i, j] for i in range(len(matrix)) for j in range(i, len(matrix))]


def motions_without_loads(machine: Machine, response: Response, joints: Joints | None) -> SpringMotions:
    """Return the motions of a machine with relaxed springs; arguments as of `machine_of_known_modes`."""
    machine_cut = cut(with_share(mechanism_of(machine, response.configuration, joints, None), 0.0))
    if machine_cut is None:
        raise ValueError("loops that cannot be cut have no motions over scalars")
    return SpringMotions(machine_cut, [0.0] * machine_cut.unknown_places.count)


@dataclass(frozen=True)
class ModeCounts:
    """Numbers of modes that programs need to be given, in the order of their columns.

    Attributes:
        loaded: modes at rest under the loads.
        factor: 1 if the mode in which the machine gives way is one of them, else 0.
        free: modes with relaxed springs.
    """

    loaded: int = 0
    factor: int = 0
    free: int = 0

    @property
    def at_rest(self) -> bool:
        """Whether modes at rest are needed."""
        return self.loaded + self.factor > 0

    def needed_by(self, quantity: MapQuantity) -> bool:
        """Whether a quantity needs some of them."""
        if quantity.loaded == "factor":
            return bool(self.factor)
        return quantity.modal and bool(self.loaded if quantity.loaded else self.free)


def mode_counts_of(machine: Machine, names: Iterable[str], varying: Collection[str]) -> ModeCounts | None:
    """Decide which modes over springs programs need for some quantities; None if they need none, or cannot use them.

    Args:
        machine: the machine with its masses.
        names: names of quantities.
        varying: leaf paths of the parameters that vary.
    """
    rows = [QUANTITIES[name] for name in names]
    modal = [row for row in rows if row.modal or row.loaded == "factor"]
    if not modal:
        return None
    state, is_platform_alone = state_of(machine), platform_alone(machine, varying)
    with np.errstate(all="ignore"):
        machine_cut = cut(state.free_equations.mechanism)
    if machine_cut is None or not machine_cut.legs or not springs_follow_ways(machine_cut):
        return None
    sizes = spring_sizes(machine_cut)
    most = sizes.springs - sizes.conditions
    counts = []
    for at_rest in (True, False):
        numbers = [int(row.name.rpartition("_")[2]) for row in modal if row.modal and bool(row.loaded) == at_rest]
        counts.append(min(most, max(numbers) + SPARE_MODES) if numbers and not is_platform_alone else 0)
    loaded, free = counts
    result = ModeCounts(loaded, int(any(row.loaded == "factor" for row in modal)), free)
    return result if result != ModeCounts() else None


def sizes_over_springs(machine: Machine) -> SpringSizes:
    """Count the springs of a machine whose legs close loops, and what would open its legs."""
    with np.errstate(all="ignore"):
        machine_cut = cut(state_of(machine).free_equations.mechanism)
    if machine_cut is None:
        raise ValueError("loops that cannot be cut have no motions over springs")
    return spring_sizes(machine_cut)
