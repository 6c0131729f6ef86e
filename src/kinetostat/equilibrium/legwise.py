"""Newton's step of machines whose legs close loops, over scalars: each leg is condensed onto the platform by itself.

What is left of a leg are the wrenches that it can exert on the platform, with a compliance of their own. The step is
then that of a free machine: statics with the wrenches of all legs, and least energy where there are more of them than
the load needs. Rigid parts are wrenches without a compliance, so that no stiffness is infinite.

Source: theory (44) and what follows it. Units, axes and origin are those of `mechanism`.
"""

from collections.abc import Sequence

import numpy as np

from kinetostat.algebra.scalar import Scalar, inner_product, is_zero, sqrt, total, where
from kinetostat.algebra.solve import Eliminated, Row, conjugate, definite, elimination, right_inverse, semidefinite_root
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import LegTerms, leg_terms, platform_load
from kinetostat.equilibrium.cut import Cut, loads_of_rods, pull_of, wrench_of_rods
from kinetostat.equilibrium.elastic_legs import ElasticLeg
from kinetostat.equilibrium.mechanism import Mechanism
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain
from kinetostat.machine.leg import Spring
from kinetostat.numerics.motions import Motions, brackets_by, cross, of_scalars, skew_of
from kinetostat.tolerances import ROUND_OFF_OF_COMPLIANCE, SURELY_MORE, ZERO_PIVOT


def array_of(rows: Sequence[Sequence[Scalar]], *shape: int) -> Array:
    """Scalars of any kind as a matrix of this shape, which may be empty."""
    result = np.full(shape, 0.0, dtype=object)
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            result[i, j] = entry
    return result


def product(left: Array, right: Array) -> Array:
    """The product of matrices of scalars, or of a matrix and a vector; NumPy has integers where nothing is summed."""
    return left @ right if left.shape[1] else np.full((len(left), *right.shape[1:]), 0.0, dtype=object)


def symmetric_product(left: Array, right: Array) -> Array:
    """The product of two matrices where it is symmetric: only its upper triangle is computed."""
    size = len(left)
    result = np.full((size, size), 0.0, dtype=object)
    for i in range(size):
        result[i, i:] = product(left[i : i + 1], right[:, i:])[0]
        result[i:, i] = result[i, i:]
    return result


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Blocks one below the other, each beside those before it."""
    result = np.full((sum(len(b) for b in blocks), sum(b.shape[1] for b in blocks)), 0.0, dtype=object)
    row = column = 0
    for block in blocks:
        result[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return result


class CondensedLeg:
    """A leg at some coordinates and under some wrench: what it adds to the equations of the platform.

    With p for its passive motions and s for its springs, its closing conditions give dp = P (d + g - J_s ds), where d
    is the twist of the platform, g the gap and P J_p = 1. W spans the wrenches that do no work on passive motions, and
    v are those by which the leg's wrench changes: C v - A d = h, and A^T v + S d is what the leg takes of the load.

    Attributes:
        placed: its chain at these coordinates.
        terms: its contribution to the equations there, or in the free state.
        elastic, passive: which of its coordinates are those of springs, and which are those of joints.
        passive_by_twist: P [passive x ways].
        passive_by_springs: P J_s [passive x springs].
        wrenches: W^T [wrenches x ways].
        spring_loads: W^T J_s, the load of each spring per unit of a wrench [wrenches x springs].
        lines: rows of A: W^T, and what turning wrenches add to it [wrenches x ways].
        roots: rows of a root of C [wrenches x at most as many].
        turning: S [ways x ways].
        load_taken: the load that it takes without a step [ways].
        gap: h [wrenches].
        sure: whether its passive motions are independent, and whether its springs hold it by a margin.
    """

    def __init__(
        self, leg: ElasticLeg, mechanism: Mechanism, row: Row, wrench: Row, platform: Motions, chord: bool
    ) -> None:
        """Condense a leg: close it, take its passive motions out of its equations, and then its springs.

        Each of these steps reads what those before it have set.

        Args:
            leg, mechanism: the leg, and the machine that it belongs to.
            row, wrench: its coordinates, and the wrench that the platform exerts on it [ways].
            platform: displacement of the platform.
            chord: whether to take the rates of the free state, see `LegwiseTangent`.
        """
        self._ways, count = mechanism.ways.astype(object), len(mechanism.actuators)
        acting = self._ways @ of_scalars(wrench)[0]
        self.placed, present = _terms_at(leg, mechanism, row, acting)
        self.terms = present
        geometric = present.geometric[0].astype(object)
        if chord:
            acting, geometric = 0.0 * acting, 0.0 * geometric
            self.terms = _terms_at(leg, mechanism, [0.0] * leg.size, acting)[1]
        self._driven = self.terms.driven[0][:, :count].astype(object)
        self.elastic = [number for number, spring in enumerate(leg.springs) if spring is not None]
        self.passive = [number for number, spring in enumerate(leg.springs) if spring is None]
        self._opening = self._ways.T @ _gap(platform, present.end)
        # What wrenches do by turning has a symmetric part, and one that only depends on where the leg ends.
        self._bracket = turning_of(acting, self._ways)
        self._close(self._ways.T @ self.terms.rates[0].astype(object))
        stiff = self._without_passive_motions(geometric, present.residual[0].astype(object))
        self._condense_springs(stiff, of_scalars(wrench)[0])

    def _close(self, rates: Array) -> None:
        """Solve the closing conditions for the passive motions.

        Args:
            rates: J, the twist of the leg's end per unit of each coordinate [ways x coordinates].
        """
        size = len(rates)
        self.sure: Scalar = True
        self.passive_by_twist, self.wrenches = np.zeros((0, size), dtype=object), np.eye(size).astype(object)
        if self.passive:
            solution, rest, margin = right_inverse(rates[:, self.passive].T.tolist())
            self.passive_by_twist = array_of(solution, size, len(self.passive)).T
            self.wrenches = array_of(rest, len(rest), size)
            self.sure = margin > SURELY_MORE
        self.passive_by_springs = product(self.passive_by_twist, rates[:, self.elastic])
        self.spring_loads = product(self.wrenches, rates[:, self.elastic])

    def _without_passive_motions(self, geometric: Array, residual: Array) -> Array:
        """Take passive motions, which follow the platform and the springs, out of the equations of the springs.

        Args:
            geometric: stiffness of all coordinates by wrenches that turn [coordinates x coordinates].
            residual: the forces that are not in balance yet, of all coordinates [coordinates].

        Returns:
            The stiffness of the springs, their own and that of turning wrenches [springs x springs].
        """
        self._inner = geometric[np.ix_(self.passive, self.passive)]
        self._mixed = geometric[np.ix_(self.passive, self.elastic)]
        inner_loads = product(self._inner, self.passive_by_springs)
        half = product(self.passive_by_springs.T, self._mixed - 0.5 * inner_loads)
        stiff = geometric[np.ix_(self.elastic, self.elastic)] - half - half.T
        for place, number in enumerate(self.elastic):
            stiff[place, place] = stiff[place, place] + self.terms.carrying[0, number]
        self._coupling = self._mixed - inner_loads
        self._spring_residual = residual[self.elastic] - product(self.passive_by_springs.T, residual[self.passive])
        self._passive_residual = residual[self.passive]
        return stiff

    def _condense_springs(self, stiff: Array, wrench: Array) -> None:
        """Eliminate the springs: what remains are the wrenches of the leg with their compliance.

        With E = L D L^T for the stiffness of the springs, products with its inverse are those of rows that L has been
        taken from.

        Args:
            stiff: E [springs x springs].
            wrench: the wrench that the platform exerts on the leg [ways].
        """
        count = len(self.elastic)
        self._factors = elimination(stiff.tolist())
        self.sure = self.sure & definite(self._factors, stiff.tolist())
        loads, coupled, remaining = (
            array_of([self._factors.forward(row) for row in rows.tolist()], len(rows), count)
            for rows in (self.spring_loads, self._coupling, self._spring_residual[None])
        )
        shrink = of_scalars(self._factors.shrink)[0]
        solved, driven = loads * shrink, coupled * shrink
        self.lines = self.wrenches + product(product(solved, coupled.T), self.passive_by_twist)
        self.gap = self.lines @ self._opening + product(solved, remaining[0])
        if len(loads) < count:  # a square root has fewer columns than there are springs
            soft = symmetric_product(loads, solved.T).tolist()
            self.roots = array_of(semidefinite_root(soft), len(loads), len(loads))
        else:
            self.roots = loads * of_scalars([sqrt(abs(part)) for part in shrink])[0]
        stiffening = self._inner - symmetric_product(driven, coupled.T)
        by_twist = self.passive_by_twist
        self.turning = symmetric_product(by_twist.T, product(stiffening, by_twist)) + self._bracket
        pressed = product(by_twist.T, self._passive_residual - product(driven, remaining[0]))
        self.load_taken = wrench + pressed + self.turning @ self._opening

    def step(self, twist: Array, change: Array) -> tuple[Row, Row]:
        """Return the steps of its coordinates and of its wrench.

        Args:
            twist: step of the platform [ways].
            change: changes of the wrenches that it can exert [wrenches].
        """
        end_step = twist + self._opening
        following = product(self.passive_by_twist, end_step)
        pushed = product(self.spring_loads.T, change) - product(self._coupling.T, following) - self._spring_residual
        springs = of_scalars(self._factors.solve(pushed.tolist()))[0]
        passive = following - product(self.passive_by_springs, springs)
        result = np.zeros(len(springs) + len(passive), dtype=object)
        result[self.elastic], result[self.passive] = springs, passive
        pressed = self._passive_residual + product(self._inner, passive) + product(self._mixed, springs)
        wrench = product(self.wrenches.T, change) + product(self.passive_by_twist.T, pressed) + self._bracket @ end_step
        return result.tolist(), wrench.tolist()

    def holding(self, change: Row) -> Array:
        """The loads that keep the machine's actuators after its wrench has changed so [actuators]; 0 of other legs."""
        count = self._driven.shape[1]
        return self.terms.holding[0, :count] + self._driven.T @ (self._ways @ of_scalars(change)[0])


def _terms_at(leg: ElasticLeg, mechanism: Mechanism, row: Row, acting: Array) -> tuple[PlacedChain, LegTerms]:
    """A leg at some coordinates, and its contribution to the equations while a wrench acts on it [6]."""
    coordinates, amounts = of_scalars(row), mechanism.undriven_amounts
    placed = leg.chain.place(coordinates, amounts)
    return placed, leg_terms(leg, coordinates, acting[None], amounts, mechanism.gravity, placed, symmetric=True)


def _gap(platform: Motions, end: Motions) -> Array:
    """The screw from the end of a leg to the platform, to first order [6]: 0 where the leg closes."""
    rotation = platform.rotation[0] @ end.rotation[0].T
    sines = of_scalars([0.5 * (rotation[i, j] - rotation[j, i]) for i, j in ((2, 1), (0, 2), (1, 0))])
    return np.concatenate([sines, platform.translation - end.translation - cross(sines, end.translation)], axis=1)[0]


def turning_of(wrench: Array, ways: Array) -> Array:
    """Half of the work of a wrench [6] on the brackets of two twists each [ways x ways]; it is antisymmetric."""
    return 0.5 * (ways.T @ brackets_by(wrench[None], ways.T[None])[0].T)


@dataclass(frozen=True)
class Condensed:
    """The platform, held by the wrenches of legs and rods.

    Attributes:
        root: G, where G G^T is the compliance of springs alone at the place [ways x ways].
        twist: step of the platform [ways].
        changes: changes of all wrenches [wrenches].
        rates: the symmetric part of 1 + G^T S G [ways x ways].
        factors: the triangular factors of 1 + G^T S G.
        stable: whether the tangent stiffness is positive definite by a margin, and no rank is in doubt.
    """

    root: Array
    twist: Array
    changes: Array
    rates: Array
    factors: Eliminated
    stable: Scalar


def solve_condensed(lines: Array, roots: Array, turning: Array, load: Array, gaps: Array) -> Condensed:
    """Solve A^T v + S d = f and C v - A d = h for the twist d of the platform and the changes v of wrenches.

    Args:
        lines: A, at least as many rows as there are ways.
        roots: R with C = R R^T, as many rows.
        turning: S.
        load: f.
        gaps: h.
    """
    size = lines.shape[1]
    answers, internal_changes, sure = _shared_by_least_energy(lines, roots, gaps)
    deflections, shares = answers[:, : roots.shape[1]], answers[:, roots.shape[1] :]
    soft = symmetric_product(deflections, deflections.T)
    # Gaps are closed by a twist of their own; what the load adds moves only what is compliant.
    root, closing = np.array(semidefinite_root(soft.tolist()), dtype=object), -(shares @ gaps)
    rates = np.eye(size) + root.T @ turning @ root
    factors = elimination(rates.tolist(), symmetric=False)
    twist = closing + root @ of_scalars(factors.solve((root.T @ (load - turning @ closing)).tolist()))[0]
    changes = shares.T @ (load - turning @ twist) + internal_changes
    symmetric = 0.5 * (rates + rates.T)
    return Condensed(
        root=root,
        twist=twist,
        changes=changes,
        rates=symmetric,
        factors=factors,
        stable=sure & definite(elimination(symmetric.tolist()), symmetric.tolist()),
    )


def _shared_by_least_energy(lines: Array, roots: Array, gaps: Array) -> tuple[Array, Array, Scalar]:
    """Share loads among the wrenches of all legs by least energy (force method), and close their gaps.

    Amounts of wrenches that balance a load are those of least norm, and any mix of internal ones, which balance each
    other. Internal ones are made conjugate, so that each is left out of the others by itself.

    Args:
        lines, roots, gaps: as of `solve_condensed`.

    Returns:
        For each unit load [ways], what all springs carry and then the amounts of all wrenches [ways x (springs +
        wrenches)]; the amounts by which internal ones change to close gaps [wrenches]; and whether no rank is in doubt.
    """
    size, count = lines.shape[1], roots.shape[1]
    balanced, internal, margin = right_inverse(lines.T.tolist())
    mixes = np.array([*zip(*balanced, strict=True), *internal], dtype=object)
    with_springs = np.concatenate([product(mixes, roots), mixes], axis=1)
    squares = [inner_product(column, column) for column in roots.T.tolist()]
    squares = [1.0 if is_zero(square) else where(square > ZERO_PIVOT, square, 1.0) for square in squares]
    modes = conjugate(with_springs[size:].tolist(), [1.0] * count, squares)
    answers, internal_changes = with_springs[:size], np.full(len(lines), 0.0, dtype=object)
    for row, inverse in zip(modes.columns, modes.inverses, strict=True):
        mode = np.array(row, dtype=object)
        shares = product(answers[:, :count], mode[:count]) * inverse
        answers = answers - shares[:, None] * mode
        internal_changes = internal_changes + mode[count:] * (mode[count:] @ gaps * inverse)
    return answers, internal_changes, (margin > SURELY_MORE) & (modes.doubt < 0.5)


class LegwiseTangent:
    """Resistance of a machine with legs that close loops at some coordinates, and Newton's step from there.

    Its `step`, `motion`, `rank`, `platform` and `slack` are as of `reduced.Tangent`.

    Attributes:
        legs, pulls: what each leg and each rod adds.
        lines: the wrenches of rods and of legs, as rows [wrenches x ways].
        turning: stiffness by loads and pulls of rods that turn [ways x ways].
        twist: step of the platform, at the origin [6].
    """

    def __init__(self, machine: Cut, coordinates: Row, chord: bool = False) -> None:
        """Condense all legs.

        Args:
            machine: the machine.
            coordinates: its unknowns, in the order of `Cut.unknown_places`.
            chord: whether to take the rates of springs alone in the free state. The step then is one of the chord
                method (the simplified Newton method): it takes a quarter of the operations and leaves a share of what
                is missing that is as small as the loads turn the legs.
        """
        self.mechanism, self._rods = machine.mechanism, machine.rods
        mechanism, places = machine.mechanism, machine.unknown_places
        self._ways = ways = mechanism.ways.astype(object)
        carried = of_scalars(coordinates[places.platform])
        placed = machine.carrier.chain.place(carried, mechanism.undriven_amounts)
        self.platform = placed.end
        is_free = all(is_zero(coordinate) for coordinate in coordinates)
        self.pulls = [pull_of(rod, None if is_free else self.platform) for rod in machine.rods]
        self.slack: Scalar = 0.0  # `cut` takes no machine with such legs whose rods carry one sign only
        self.rank = len(machine.rods) + sum(len(leg.springs) - leg.springs.count(None) for leg in machine.legs)
        force, self.turning = self._platform_and_rods()
        turning = 0.0 * self.turning if chord else self.turning
        self.legs: list[CondensedLeg] = []
        for leg, of_leg, of_wrench in zip(machine.legs, places.coordinates, places.wrenches, strict=True):
            condensed = CondensedLeg(leg, mechanism, coordinates[of_leg], coordinates[of_wrench], self.platform, chord)
            self.legs.append(condensed)
            force, turning = force - condensed.load_taken, turning + condensed.turning
        lines = [[part * (1.0 / pull.length) for part in pull.line] for pull in self.pulls]
        of_rods = array_of(lines, len(lines), 6) @ ways
        self.lines = np.concatenate([of_rods, *(leg.wrenches for leg in self.legs)])
        self._solved = self._solve_platform(of_rods, turning, force)
        self.twist: Row = (ways @ self._solved.twist).tolist()
        self.step, self.motion, self._changes = self._steps(ways.T @ placed.screws[0].T)

    def _solve_platform(self, of_rods: Array, turning: Array, load: Array) -> Condensed:
        """Solve for the twist of the platform and the changes of all wrenches, of rods and then of legs.

        Args:
            of_rods: lines of the rods [rods x ways].
            turning, load: as of `solve_condensed`.
        """
        lines = np.concatenate([of_rods, *(leg.lines for leg in self.legs)])
        gaps = np.concatenate([np.full(len(of_rods), 0.0, dtype=object), *(leg.gap for leg in self.legs)])
        roots = [array_of([[sqrt(rod.softness)]], 1, 1) for rod in self._rods] + [leg.roots for leg in self.legs]
        return solve_condensed(lines, block_diagonal(roots), turning, load, gaps)

    def _platform_and_rods(self) -> tuple[Array, Array]:
        """The load on the platform that rods do not hold [ways], and the stiffness by its turning [ways x ways]."""
        ways = self._ways
        densities = [-(pull.force_density * (1.0 / (pull.length * pull.length))) for pull in self.pulls]
        load, load_change = platform_load(self.mechanism, self.platform)
        rods_load, rods_change = wrench_of_rods(self.pulls, densities)
        return ways.T @ (load + rods_load)[0], ways.T @ (rods_change - load_change)[0] @ ways

    def _steps(self, rates: Array) -> tuple[Row, Row, list[Row]]:
        """Steps of all coordinates and wrenches; those that are motions; and those of each leg's wrench."""
        # Slides come first among the coordinates, and last in the twist.
        moving = elimination(rates[::-1].tolist(), symmetric=False).solve(self._solved.twist[::-1].tolist())
        step, motion, changes, first = [*moving], self._solved.twist.tolist(), [], len(self.pulls)
        for leg in self.legs:
            last = first + len(leg.gap)
            coordinates, wrench = leg.step(self._solved.twist, self._solved.changes[first:last])
            first = last
            step, motion = [*step, *coordinates, *wrench], [*motion, *coordinates]
            changes.append(wrench)
        return step, motion, changes

    @property
    def stable(self) -> Scalar:
        """Whether the tangent stiffness is positive definite by a margin, and all ranks are sure."""
        result = self._solved.stable
        for leg in self.legs:
            result = result & leg.sure
        return result

    def actuator_loads(self) -> list[tuple[Spring, Scalar]]:
        """Every actuator with what it carries after the step, N or N·m, positive where it is pulled open."""
        force, length = self.mechanism.force[0], self.mechanism.length[0]
        loads = loads_of_rods(self._rods, self.pulls, self.twist, force)
        holding = total([leg.holding(change) for leg, change in zip(self.legs, self._changes, strict=True)])
        springs_of_rods = [spring for spring, _ in loads]
        for spring, load in zip(self.mechanism.driven, holding.tolist(), strict=True):
            if spring not in springs_of_rods:
                loads.append((spring, load * (force if spring.joint.point is None else force * length)))
        return loads

    def over_springs(self, matrix: Array) -> tuple[Array, Array]:
        """The tangent stiffness and another matrix by twists of the platform [6 x 6], in coordinates of the springs.

        The deflections y of springs move the platform by G y; in them the stiffness is 1 + G^T S G, and what is rigid
        does not occur. Symmetric parts [ways x ways].
        """
        root = self._ways @ self._solved.root
        return self._solved.rates, root.T @ matrix @ root

    def compliance(self) -> list[Row]:
        """C at the loaded tool point [6][6], 0 of what is the square of round-off."""
        back = np.eye(6, dtype=object)
        back[3:, :3] = -skew_of(self.platform.translation)[0]
        rows = back @ self._ways @ self._solved.root
        solved = [of_scalars(self._solved.factors.solve(row))[0] for row in rows.tolist()]
        whole = np.array([[row @ column for column in solved] for row in rows], dtype=object)
        whole = 0.5 * (whole + whole.T)
        least = ROUND_OFF_OF_COMPLIANCE * (1.0 + total([abs(whole[i, i]) for i in range(6)]))
        moves = [abs(whole[i, i]) > least for i in range(6)]
        return [[where(moves[i] & moves[j], whole[i, j], 0.0) for j in range(6)] for i in range(6)]
