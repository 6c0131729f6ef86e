"""Motions of a machine whose legs close loops, by the deflections of its springs: frequencies, load factor.

The unknowns y are deflections times roots of stiffnesses, so that springs alone make the stiffness 1. They tell how the
platform moves and how each leg follows; combinations that would open a leg are projected out. The modes
are solved for elsewhere, by a loop or a library; here they are numbers, whose errors count by their squares alone.

Source: theory (44), (58) and (63). Units are those of `equilibrium.mechanism`.
"""

import math
from collections.abc import Collection, Iterable, Sequence

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
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine
from kinetostat.numerics.motions import of_scalars
from kinetostat.tolerances import SURELY_MORE, UNRESISTED
from kinetostat.vibration.inertia import energies, leg_rates, platform_inertia
from kinetostat.vibration.reduced import platform_alone
from kinetostat.vibration.slopes import EQUALS, energy_of


@dataclass(frozen=True)
class SpringSizes:
    """Sizes of what `SpringMotions.parts` gives.

    Attributes:
        ways: motions that the platform has.
        springs: all springs of legs and rods.
        conditions: combinations of deflections that would open a leg.
    """

    ways: int
    springs: int
    conditions: int

    def upper(self, rows: Array) -> Array:
        """Symmetric matrices [n x springs x springs] from their upper triangles, row by row [n x entries]."""
        result = np.zeros((len(rows), self.springs, self.springs))
        i, j = np.triu_indices(self.springs)
        result[:, i, j] = result[:, j, i] = rows
        return result

    def modes(self, parts: Array, count: int, massive: bool = True) -> Array:
        """The modes of n states that give most first: 1 / omega², or least stiffness [n x count x springs].

        Args:
            parts: results of `SpringMotions.parts` [entries x n].
            count: of modes; those that a machine does not have are zero.
            massive: whether masses count; without them, modes are those of the least stiffness.

        Returns:
            The modes; NaN where springs and loads do not hold the machine.
        """
        ways, size = self.ways * self.springs, self.conditions * self.springs
        ends = np.cumsum([ways, ways, ways, size, size, self.springs * (self.springs + 1) // 2])
        twists, pushed, turned, closing, back, heavy, stiff = np.split(parts.T, ends, axis=1)
        twists, pushed, turned, closing = (
            rows.reshape(len(rows), -1, self.springs) for rows in (twists, pushed, turned, closing)
        )
        ones = np.eye(self.springs)
        kept = ones - back.reshape(len(back), self.springs, -1) @ closing
        mixed = [np.swapaxes(twists, 1, 2) @ part for part in (pushed, turned)]
        mass, stiffness = (
            kept @ (part + np.swapaxes(part, 1, 2) + self.upper(rows)) @ kept
            for part, rows in zip(mixed, (heavy, stiff), strict=True)
        )
        result = np.full((len(kept), count, self.springs), np.nan)
        sound = np.flatnonzero(np.isfinite(mass).all(axis=(1, 2)) & np.isfinite(stiffness).all(axis=(1, 2)))
        sizes, axes = np.linalg.eigh(ones + stiffness[sound])
        stable = sizes[:, 0] > 0.0
        rows, sizes, axes = sound[stable], sizes[stable], axes[stable]
        factors = axes / np.sqrt(sizes)[:, None]
        ringing = np.swapaxes(factors, 1, 2) @ (mass if massive else kept)[rows] @ factors
        shapes = factors @ np.linalg.eigh(ringing)[1][:, :, ::-1]
        shown = min(count, self.springs - self.conditions)
        result[rows] = 0.0
        result[rows, :shown] = np.swapaxes(shapes, 1, 2)[:, :shown]
        return result


def spring_sizes(machine: Cut) -> SpringSizes:
    """Count the springs and conditions of a machine with its loops cut."""
    ways = machine.mechanism.ways.shape[1]
    free = [leg.springs.count(None) for leg in machine.legs]
    springs = len(machine.rods) + sum(len(leg.springs) for leg in machine.legs) - sum(free)
    return SpringSizes(ways, springs, len(machine.rods) + sum(ways - count for count in free) - ways)


def in_its_ways(machine: Cut) -> bool:
    """Whether all springs of legs deflect in motions that the machine has; those of a planar machine may not."""
    outside = np.eye(6) - machine.mechanism.ways @ machine.mechanism.ways.T
    return all(not (leg.chain.twists.astype(float) @ outside).any() for leg in machine.legs)


class SpringMotions:
    """The motions of a machine at some coordinates, over the deflections of its springs.

    Attributes:
        size: number of springs.
        sure: whether the conditions of closed legs are independent.
    """

    def __init__(self, machine: Cut, coordinates: Row) -> None:
        """Place the machine.

        Args:
            machine: the machine with its loops cut, of which legs close some.
            coordinates: as of `LegwiseTangent`.
        """
        tangent = LegwiseTangent(machine, coordinates)
        self._machine, self._tangent = machine, tangent
        mechanism, length = machine.mechanism, machine.mechanism.length
        ways = mechanism.ways.astype(object)
        self._shrink = [
            np.array([*(1.0 / sqrt(part) for part in leg.terms.carrying[0, leg.elastic]), None], dtype=object)[:-1]
            for leg in tangent.legs
        ]
        felt = [array_of([[sqrt(rod.softness)]], 1, 1) for rod in machine.rods]
        felt += [leg.felt * shrink for leg, shrink in zip(tangent.legs, self._shrink, strict=True)]
        stretched = block_diagonal(felt)
        self.size = stretched.shape[1]
        balanced, internal, _ = right_inverse(tangent.lines.T.tolist())
        count = len(internal)
        self._twists = product(array_of(balanced, len(tangent.lines), ways.shape[1]).T, stretched)
        self._closing = product(array_of(internal, count, len(tangent.lines)), stretched)
        self.sure: Scalar = True
        self._back = array_of([], self.size, 0)
        if count:
            solution, _, margin = right_inverse(self._closing.tolist())
            self._back, self.sure = array_of(solution, self.size, count), margin > SURELY_MORE
        self._inertia = platform_inertia(mechanism.platform, tangent.platform, length)[0]
        for rod, pull in zip(machine.rods, tangent.pulls, strict=True):
            if not is_zero(rod.rotor):
                line = np.array([part * (1.0 / pull.length) for part in pull.line], dtype=object)
                self._inertia = self._inertia + np.outer(line, line) * (rod.rotor * length[0])
        self._inertia = ways.T @ self._inertia @ ways

    def parts(self) -> list[Scalar]:
        """The parts of which loops make the mass M and the stiffness K over y, row by row.

        With the twists T y of the platform, M is T^T H + H^T T + D and K is 1 + T^T F + F^T T + E, of D and E the upper
        triangles. Legs stay closed where A y = 0.

        Returns:
            T, H, F [ways x springs], A [conditions x springs], A+ [springs x conditions], D, E.
        """
        machine, tangent = self._machine, self._tangent
        length, blocks = machine.mechanism.length, []
        sums = []
        for stiff in (False, True):
            whole = tangent.turning if stiff else self._inertia
            mixed, alone = [], []
            for leg, elastic, shrink in zip(tangent.legs, machine.legs, self._shrink, strict=True):
                if stiff:
                    matrix = leg.terms.geometric[0].astype(object)
                else:
                    matrix = np.diag(elastic.rotors[0].astype(object) * length[0])
                    for _, part in energies(elastic.masses, leg_rates(elastic, leg.placed), length):
                        matrix = matrix + part[0]
                follows, stretches = self._rates_of(leg, shrink)
                pushed = product(matrix, stretches)
                whole = whole + symmetric_product(follows.T, product(matrix, follows))
                mixed.append(product(follows.T, pushed))
                alone.append(symmetric_product(stretches.T, pushed))
            count = len(machine.rods)
            whole = 0.5 * (whole + whole.T)
            beside = np.concatenate([array_of([], len(whole), count), *mixed], axis=1)
            sums.append(0.5 * product(whole, self._twists) + beside)
            blocks.append(block_diagonal([array_of([], count, count), *alone]))
        rows = [self._twists, *sums, self._closing, self._back]
        upper = [matrix[i, j] for matrix in blocks for i in range(self.size) for j in range(i, self.size)]
        return [entry for row in rows for entry in row.ravel().tolist()] + upper

    @staticmethod
    def _rates_of(leg: CondensedLeg, shrink: Array) -> tuple[Array, Array]:
        """Motion of a leg's coordinates by the twist of the platform and by the leg's springs."""
        size = len(leg.elastic) + len(leg.passive)
        follows = np.full((size, leg.across.shape[1]), 0.0, dtype=object)
        stretches = np.full((size, len(leg.elastic)), 0.0, dtype=object)
        follows[leg.passive] = leg.closes
        stretches[leg.passive] = -(leg.follows * shrink)
        for place, number in enumerate(leg.elastic):
            stretches[number, place] = shrink[place]
        return follows, stretches

    def square(self, mode: Sequence[Scalar]) -> Scalar:
        """1 / omega² of a mode, s²."""
        twist, moved, deflections = self._motion(mode)
        machine, tangent, length = self._machine, self._tangent, self._machine.mechanism.length
        kinetic = twist @ (self._inertia @ twist)
        for leg, elastic, motion in zip(tangent.legs, machine.legs, moved, strict=True):
            kinetic = kinetic + energy_of(elastic.masses, leg_rates(elastic, leg.placed), motion, length)
            kinetic = kinetic + length[0] * total(list(elastic.rotors[0] * motion * motion))
        return kinetic / (deflections @ deflections + self._work_of_turning(twist, moved))

    def factor(self, mode: Sequence[Scalar]) -> Scalar:
        """By which the load may grow until the machine gives way in a mode."""
        twist, moved, deflections = self._motion(mode)
        share = -(self._work_of_turning(twist, moved) / (deflections @ deflections))
        grows = share > UNRESISTED
        return where(grows, 1.0 / where(grows, share, 1.0), math.inf)

    def _motion(self, mode: Sequence[Scalar]) -> tuple[Array, list[Array], Array]:
        """The twist of the platform, the coordinates of all legs, and y, of a mode without what opens legs."""
        deflections = of_scalars([*mode])[0]
        if len(self._closing):
            deflections = deflections - self._back @ (self._closing @ deflections)
        twist, start, moved = self._twists @ deflections, len(self._machine.rods), []
        for leg, shrink in zip(self._tangent.legs, self._shrink, strict=True):
            follows, stretches = self._rates_of(leg, shrink)
            moved.append(product(follows, twist) + product(stretches, deflections[start : start + len(shrink)]))
            start += len(shrink)
        return twist, moved, deflections

    def _work_of_turning(self, twist: Array, moved: Sequence[Array]) -> Scalar:
        """Twice the work of loads and wrenches that turn."""
        work = twist @ (self._tangent.turning @ twist)
        for leg, motion in zip(self._tangent.legs, moved, strict=True):
            work = work + motion @ (leg.terms.geometric[0].astype(object) @ motion)
        return work


def motions_without_loads(machine: Machine, response: Response, joints: Joints | None) -> SpringMotions:
    """The motions of a machine with relaxed springs, with numbers of any kind; arguments as of `vibrating`."""
    machine_cut = cut(with_share(mechanism_of(machine, response.configuration, joints, None), 0.0))
    if machine_cut is None:
        raise ValueError("loops that cannot be cut have no motions over scalars")
    ways = machine_cut.mechanism.ways.shape[1]
    return SpringMotions(
        machine_cut, [0.0] * (machine_cut.carrier.size + sum(leg.size + ways for leg in machine_cut.legs))
    )


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


def mode_counts_of(machine: Machine, names: Iterable[str], varying: Collection[str]) -> ModeCounts | None:
    """Decide which modes over springs programs need for some quantities; None if they need none, or cannot use them.

    Args:
        machine: with its masses.
        names: of quantities.
        varying: leaf paths of the parameters that vary.
    """
    rows = [QUANTITIES[name] for name in names]
    modal = [row for row in rows if row.modal or row.loaded == "factor"]
    if not modal:
        return None
    state, alone = state_of(machine), platform_alone(machine, varying)
    with np.errstate(all="ignore"):
        machine_cut = cut(state.free_equations.mechanism)
    if machine_cut is None or not machine_cut.legs or not in_its_ways(machine_cut):
        return None
    most = spring_sizes(machine_cut).springs - spring_sizes(machine_cut).conditions
    wanted = [
        max([int(row.name.rpartition("_")[2]) for row in modal if row.modal and bool(row.loaded) == at_rest], default=0)
        for at_rest in (True, False)
    ]
    loaded, free = (min(most, count + EQUALS) if count and not alone else 0 for count in wanted)
    result = ModeCounts(loaded, int(any(row.loaded == "factor" for row in modal)), free)
    return result if result != ModeCounts() else None


def sizes_over_springs(machine: Machine) -> SpringSizes:
    """Count the springs of a machine whose legs close loops, and what would open its legs."""
    with np.errstate(all="ignore"):
        machine_cut = cut(state_of(machine).free_equations.mechanism)
    if machine_cut is None:
        raise ValueError("loops that cannot be cut have no motions over springs")
    return spring_sizes(machine_cut)
