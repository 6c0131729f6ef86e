"""Natural vibrations about a state: frequencies, and how everything moves in each.

All motions that obey the closing of the legs are combinations of a few, Z. In them springs and masses are K and M, and
K y mu = M y has an answer for each: mu = 1 / omega². A motion without mass has mu = 0, so that it needs no special
case: it follows the others at once, and adds to the compliance only. Motions y are scaled so that y^T K y = 1, the
strain energy of each is then one half, and so is its kinetic energy.

Source: theory (58) and (59). Units are those of `equilibrium.mechanism`; mu is in s².
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array, Integers, Mask
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.elastic_legs import idle_motions
from kinetostat.equilibrium.mechanism import LegwisePlaces
from kinetostat.equilibrium.tangent import conditions_of_leg, finite_poses, over_motions, tangent_matrices
from kinetostat.frozen import dataclass
from kinetostat.kinetostatics.quantities import MODES
from kinetostat.numerics.motions import skew_of
from kinetostat.tolerances import CLOSING_ROUND_OFF, EQUAL_STIFFNESSES, NO_MOMENTUM, UNRESISTED
from kinetostat.vibration.inertia import leg_rates, mass_matrices, platform_inertia

CLEAR_SHARE = 0.1
"""Share of the largest component of the tool's motion from which modes clearly move the tool along a component: far
above round-off, so that this does not choose the component."""


@dataclass(frozen=True)
class Drive:
    """Deflection of the spring of an actuator in each mode.

    Attributes:
        name: name of the actuator.
        turning: whether it turns, otherwise it slides.
        motion: deflection in each mode, of the scale of `Modes.tool` [m].
    """

    name: str
    turning: bool
    motion: Array


@dataclass(frozen=True)
class Modes:
    """The natural vibrations at one pose, from the lowest frequency; motions without mass come last.

    Attributes:
        inverse_squares: 1 / omega² of each mode, s² [m]; 0 where nothing has mass.
        shapes: rates of the twist of the platform along its ways, and of all coordinates of the legs, scaled to
            a strain energy of one half [coordinates x m].
        tool: twist of the tool point in each, base axes, of the same scale: rad and m per root of a joule [6 x m].
        drives: the actuators that deflect.
    """

    inverse_squares: Array
    shapes: Array
    tool: Array
    drives: tuple[Drive, ...] = ()

    @property
    def mode_count(self) -> int:
        """Number of modes that have mass, and so a frequency."""
        return int((self.inverse_squares > 0.0).sum())

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, Hz [modes]."""
        return np.asarray(0.5 / np.pi / np.sqrt(self.inverse_squares[: self.mode_count]))


def mass_matrix(equations: Balance) -> Array:
    """Return M over the ways of the platform and all coordinates of the legs [n x coordinates x coordinates], s²."""
    mechanism, state, places = equations.mechanism, equations.state, equations.mechanism.motion_places
    ways, length = mechanism.ways, mechanism.length
    result = np.zeros((len(length), places.count, places.count))
    of_platform = platform_inertia(mechanism.platform, state.platform, length)
    result[:, places.platform, places.platform] = ways.T @ of_platform @ ways
    amounts = mechanism.given_amounts(state.amounts)
    for leg, coordinates, moving in zip(mechanism.legs, state.coordinates, places.coordinates, strict=True):
        of_leg = result[:, moving, moving]
        if leg.masses.carried:
            placed = leg.chain.place(coordinates, amounts)
            for _, matrix in mass_matrices(leg.masses, leg_rates(leg, placed), length):
                of_leg += matrix
        of_leg += _diagonal(leg.rotors * length[:, None])
    return result


def stiffness_matrix(equations: Balance) -> tuple[Array, Array]:
    """Return K over the same coordinates [n x coordinates x coordinates], and the conditions of closed legs.

    States of rest are solved for with a spring along each idle motion, which nothing deflects there; in vibrations
    masses would deflect it, so that it is taken away.
    """
    mechanism, matrices = equations.mechanism, tangent_matrices(equations)
    stiff = matrices.elastic + matrices.geometric
    for leg, moving in zip(mechanism.legs, mechanism.motion_places.coordinates, strict=True):
        stiff[:, moving, moving] -= leg.idle @ leg.idle.mT
    return stiff, matrices.closing


def damping_matrix(equations: Balance) -> Array:
    """Return viscous friction of joints and rotors over the same coordinates [n x coordinates x coordinates], s."""
    mechanism, places = equations.mechanism, equations.mechanism.motion_places
    result = np.zeros((len(mechanism.length), places.count, places.count))
    for leg, moving in zip(mechanism.legs, places.coordinates, strict=True):
        result[:, moving, moving] = _diagonal(leg.dampers * mechanism.length[:, None])
    return result


def _diagonal(entries: Array) -> Array:
    return np.asarray(entries[:, :, None] * np.eye(entries.shape[1]))


@dataclass(frozen=True)
class ModesOfPoses:
    """Modes of poses that have as many motions.

    Attributes:
        rows: numbers of the poses [k].
        inverse_squares: as in `Modes` [k x m].
        shapes: as in `Modes` [k x coordinates x m].
    """

    rows: Integers
    inverse_squares: Array
    shapes: Array


def solved_modes(equations: Balance, shaped: bool = True) -> Iterator[ModesOfPoses]:
    """Solve for the modes of n states; those at which springs and loads do not hold the machine are left out.

    Args:
        equations: equations of the states.
        shaped: whether shapes are wanted; without them they are empty, and frequencies take half of the time.
    """
    stiff, conditions = stiffness_matrix(equations)
    mass = mass_matrix(equations)
    idle_conditions, places = motions_left_out(equations, mass), equations.mechanism.motion_places
    sound = np.flatnonzero(finite_poses(stiff) & finite_poses(conditions))
    for rows, basis in _allowed_motions(conditions, idle_conditions, places, sound):
        stiff_within, mass_within, unit_within = (
            _over_leg_bases(matrix, rows, basis, places)
            for matrix in (stiff, mass, np.broadcast_to(np.eye(places.count), mass.shape))
        )
        holds, factors = _inverse_factors(stiff_within)
        if not holds.any():
            continue
        scaled_mass = factors @ mass_within[holds] @ factors.mT
        if shaped:
            inverse_squares, axes = np.linalg.eigh(scaled_mass)
            shapes = _over_coordinates(factors.mT @ axes[:, :, ::-1], [part[holds] for part in basis])
        else:
            inverse_squares, shapes = np.linalg.eigvalsh(scaled_mass), np.zeros((int(holds.sum()), places.count, 0))
        inverse_squares = inverse_squares[:, ::-1]
        motion_sizes = np.trace(factors @ unit_within[holds] @ factors.mT, axis1=1, axis2=2)
        round_off = NO_MOMENTUM * np.trace(mass[rows[holds]], axis1=1, axis2=2) * motion_sizes
        has_mass = inverse_squares > np.maximum(UNRESISTED * inverse_squares[:, :1], round_off[:, None])
        inverse_squares = np.where(has_mass, inverse_squares, 0.0)
        yield ModesOfPoses(rows[holds], inverse_squares, shapes)


def _allowed_motions(
    conditions: Array, idle_conditions: Array, places: LegwisePlaces, rows: Integers
) -> Iterator[tuple[Integers, list[Array]]]:
    """Give poses with as many motions that obey all conditions, and these motions leg by leg.

    A leg follows the platform by the least motion of its coordinates, and has motions of its own besides. What a leg
    cannot follow, the platform does not do.

    Args:
        conditions: conditions of closed legs [n x conditions x coordinates].
        idle_conditions: see `motions_left_out`.
        places: places of the twist and of the coordinates of each leg.
        rows: numbers of the poses at which all is finite.

    Returns:
        Numbers of poses, and their motions: those of the platform [k x ways x motions], then those of each leg
        [k x coordinates x motions], of which as many as the platform has come first and follow it.
    """
    legs = []
    for number, moving in enumerate(places.coordinates):
        idle = idle_conditions[rows, moving, moving]
        closing = conditions[rows, conditions_of_leg(number, places.platform.stop), moving]
        legs.append(_closed_leg(closing, idle[:, idle.any(axis=(0, 2))]))
    _, sizes, ways = np.linalg.svd(np.concatenate([leg.missed for leg in legs], axis=1), full_matrices=False)
    ranks = np.stack([(sizes > CLOSING_ROUND_OFF).sum(axis=1), *(leg.rank for leg in legs)], axis=1)
    for platform_rank, *leg_ranks in np.unique(ranks, axis=0):
        of_ranks = (ranks == [platform_rank, *leg_ranks]).all(axis=1)
        platform = ways[of_ranks, platform_rank:].mT
        motions = [
            np.concatenate([leg.inverse[of_ranks] @ platform, leg.motions[of_ranks, rank:].mT], axis=2)
            for leg, rank in zip(legs, leg_ranks, strict=True)
        ]
        yield rows[of_ranks], [platform, *motions]


@dataclass(frozen=True)
class _ClosedLeg:
    """A leg as it follows the platform, at n poses.

    Attributes:
        inverse: least motion of its coordinates by the twist of the platform [n x coordinates x ways].
        missed: part of a twist that it cannot follow [n x conditions x ways].
        rank: number of its independent conditions [n].
        motions: motions of its coordinates as rows; those behind the first `rank` leave the platform where it is
            [n x coordinates x coordinates].
    """

    inverse: Array
    missed: Array
    rank: Integers
    motions: Array


def _closed_leg(closing: Array, idle: Array) -> _ClosedLeg:
    """Solve the conditions of a leg by singular values.

    Args:
        closing: the twist of its end per unit of each coordinate [n x ways x coordinates].
        idle: conditions that leave out motions of the leg alone [n x conditions x coordinates].
    """
    size = closing.shape[1]
    left, sizes, right = np.linalg.svd(np.concatenate([closing, idle], axis=1))
    rank = (sizes > CLOSING_ROUND_OFF * sizes[:, :1]).sum(axis=1)
    count = sizes.shape[1]
    counts = np.arange(count) < rank[:, None]
    reciprocals = np.divide(1.0, sizes, where=counts, out=np.zeros_like(sizes))
    reached = left[:, :, :count] * counts[:, None]
    by_twist = reached.mT[:, :, :size]
    inverse = right[:, :count].mT * reciprocals[:, None] @ by_twist
    missed = np.eye(reached.shape[1])[:, :size] - reached @ by_twist
    return _ClosedLeg(inverse, missed, rank, right)


def _places_of_motions(basis: Sequence[Array]) -> Iterator[Integers]:
    """Give the places among all motions of those of the platform, and then of those of each leg.

    Motions of the platform come first, because all legs share them.
    """
    common = basis[0].shape[2]
    end = common
    yield np.arange(common)
    for part in basis[1:]:
        begin, end = end, end + part.shape[2] - common
        yield np.concatenate([np.arange(common), np.arange(begin, end)])


def _over_leg_bases(matrix: Array, rows: Integers, basis: Sequence[Array], places: LegwisePlaces) -> Array:
    """Return the symmetric part of a matrix, which couples no coordinates of different legs, over the motions."""
    motions = list(_places_of_motions(basis))
    size = 1 + max(place.max(initial=-1) for place in motions)
    result = np.zeros((len(rows), size, size))
    for part, motion, moving in zip(basis, motions, (places.platform, *places.coordinates), strict=True):
        result[:, motion[:, None], motion] += over_motions(matrix[rows, moving, moving], part)
    return result


def _over_coordinates(combinations: Array, basis: Sequence[Array]) -> Array:
    """Return combinations of motions as motions of all coordinates [k x coordinates x m]."""
    pairs = zip(basis, _places_of_motions(basis), strict=True)
    return np.concatenate([part @ combinations[:, motions] for part, motions in pairs], axis=1)


def _inverse_factors(stiff: Array) -> tuple[Mask, Array]:
    """Return whether matrices K are positive definite by a margin [k], and L^-1 of those that are, K = L L^T."""
    with suppress(np.linalg.LinAlgError):
        factors = np.linalg.inv(np.linalg.cholesky(stiff))
        # Both traces are sums of positive eigenvalues, so that their product is at least the ratio of the extremes.
        if (np.trace(stiff, axis1=1, axis2=2) * (factors**2).sum(axis=(1, 2)) < 1.0 / UNRESISTED).all():
            return np.ones(len(stiff), dtype=bool), factors
    least = np.linalg.eigvalsh(stiff)
    holds = np.asarray(least[:, 0] > UNRESISTED * least[:, -1])
    return holds, np.linalg.inv(np.linalg.cholesky(stiff[holds]))


def motions_left_out(equations: Balance, mass: Array) -> Array:
    """Return conditions that leave out motions without a frequency [n x coordinates x coordinates].

    The row of a coordinate holds a condition of its leg, or zeros; rows of the platform's twist are zero. Nothing
    leaves the plane of a planar machine. Motions of a leg that leave the platform where it is and deflect no spring,
    such as a strut that spins about its own axis, have the frequency 0: all other modes have no momentum with them.

    Args:
        equations: equations of the states.
        mass: see `mass_matrix`.
    """
    mechanism, ways, places = equations.mechanism, equations.mechanism.ways, equations.mechanism.motion_places
    result = np.zeros((len(equations.residual), places.count, places.count))
    for leg, terms, moving in zip(mechanism.legs, equations.legs, places.coordinates, strict=True):
        sizes_in_plane, sizes = (np.linalg.norm(part, axis=1) for part in (ways.T @ terms.rates, terms.rates))
        out_of_plane = (sizes_in_plane <= UNRESISTED * sizes)[:, :, None] * np.eye(leg.size)
        idle = idle_motions(terms.rates, leg.springs) if leg.idle.any() else leg.idle
        result[:, moving, moving] = _without_momentum(idle, mass[:, moving, moving]) + out_of_plane
    return result


def _without_momentum(idle: Array, mass: Array) -> Array:
    """Return rows that are 0 for motions without momentum along idle motions U, U^T M y [n x c x c].

    Along idle motions that have no mass there is no momentum; their rows leave out these motions themselves, U^T y.
    Rows of momentum have unit length, as those of motions.
    """
    masses, axes = np.linalg.eigh(np.nan_to_num(idle.mT @ mass @ idle))  # poses out of reach have no numbers
    motions = axes.mT @ idle.mT
    has_mass = masses > UNRESISTED * np.trace(mass, axis1=1, axis2=2)[:, None]
    momenta = motions @ mass
    sizes = np.where(has_mass, np.linalg.norm(momenta, axis=2), 1.0)
    return np.asarray(np.where(has_mass[:, :, None], momenta / sizes[:, :, None], motions))


def hertz(inverse_squares: Array) -> Array:
    """Return frequencies of 1 / omega² in descending order [n x m]; infinite where nothing has mass."""
    has_mass = inverse_squares > UNRESISTED * inverse_squares[:, :1]
    return np.where(has_mass, 0.5 / np.pi / np.sqrt(np.where(has_mass, inverse_squares, 1.0)), np.inf)


def frequencies(equations: Balance, count: int = MODES) -> Array:
    """Return the lowest natural frequencies of n states, Hz [n x count].

    Infinite where there are fewer modes with mass, NaN where springs and loads do not hold the machine.
    """
    result = np.full((len(equations.residual), count), np.nan)
    for part in solved_modes(equations, shaped=False):
        present = min(count, part.inverse_squares.shape[1])
        result[part.rows] = np.inf
        result[part.rows, :present] = hertz(part.inverse_squares[:, :present])
    return result


def modes(equations: Balance) -> Modes | None:
    """Return the natural vibrations at a single pose; None where springs and loads do not hold the machine there.

    A machine that is rigid throughout has none: the answer is then empty.
    """
    part = next(solved_modes(equations), None)
    if part is None:
        return None
    motions = tool_motions(equations)
    shapes = _settled_shapes(part.inverse_squares[0], part.shapes[0], motions, float(equations.mechanism.length[0]))
    return Modes(part.inverse_squares[0], shapes, motions @ shapes, tuple(_drives(equations, shapes)))


def _settled_shapes(inverse_squares: Array, shapes: Array, motions: Array, length: float) -> Array:
    """Return the same modes with what is arbitrary in them settled, so that round-off does not decide it.

    Of modes of equal frequency the first moves the tool along the first component, x y z rx ry rz, along which they
    clearly move it; the next one does not move it along this component, but along the next such one. Each moves along
    its own to the positive side.

    Args:
        inverse_squares, shapes: as in `Modes`, of one pose.
        motions: see `tool_motions`.
        length: length of the machine, by which turns are compared with displacements, m.
    """
    result = shapes.copy()
    translations_first = np.roll(motions * np.array([length] * 3 + [1.0] * 3)[:, None], 3, axis=0)
    borders = np.flatnonzero(inverse_squares[:-1] - inverse_squares[1:] > EQUAL_STIFFNESSES * inverse_squares[:-1]) + 1
    for first, last in pairwise([0, *borders.tolist(), len(inverse_squares)]):
        for place in range(first, last):
            of_equals = translations_first @ result[:, place:last]
            sizes = np.linalg.norm(of_equals, axis=1)
            row = of_equals[int(np.argmax(sizes >= CLEAR_SHARE * sizes.max()))]
            # The reflection that brings this row to its first entry.
            mirror = row - np.linalg.norm(row) * np.eye(last - place)[0]
            if mirror @ mirror > 0.0:
                result[:, place:last] -= np.outer(result[:, place:last] @ mirror, mirror) * (2.0 / (mirror @ mirror))
    return result


def _drives(equations: Balance, shapes: Array) -> Iterator[Drive]:
    """Give the deflections of actuators' springs in modes of these shapes."""
    mechanism = equations.mechanism
    length, joule = float(mechanism.length[0]), float(mechanism.force[0] * mechanism.length[0])
    for leg, places in zip(mechanism.legs, mechanism.motion_places.coordinates, strict=True):
        for place, spring in enumerate(leg.springs, places.start):
            if spring is not None and spring.actuated:
                turning = spring.joint.point is not None
                yield Drive(spring.part_name, turning, shapes[place] * (1.0 if turning else length) / np.sqrt(joule))


def tool_motions(equations: Balance) -> Array:
    """Return the twist of the tool point per unit of each coordinate, SI, for energies in joules [6 x coordinates]."""
    mechanism, ways = equations.mechanism, equations.mechanism.ways
    shift = np.eye(6)
    shift[3:, :3] = -skew_of(equations.state.platform.translation)[0]
    joule = float(mechanism.force[0] * mechanism.length[0])
    result = np.zeros((6, mechanism.motion_places.count))
    result[:, mechanism.motion_places.platform] = mechanism.twist_units[0][:, None] * (shift @ ways) / np.sqrt(joule)
    return result
