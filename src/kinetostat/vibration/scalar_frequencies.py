"""Natural frequencies over scalars, for machine code and for derivatives: by rotations, or from modes that are known.

Where the platform alone is massive, the compliance at the tool is all that is needed, whatever the legs are. Where
links or rotors are massive too, the loops of the machine are cut at its rods, as `equilibrium.reduced` does. In both
cases the eigenvalues are found by sums and Jacobi's rotations, without branches.

Machines that allow neither are solved by `modes`. The modes that it finds are given back to the formulas as columns of
numbers. To first order, a change of the machine changes mu = 1 / omega² as if the mode, and the forces that close the
legs, stayed as they are (Hellmann and Feynman). So no eigenvalue problem is differentiated, and any machine will do.

Source: theory (58), with C where the platform alone is massive, (63) and what follows it. Units are those of
`equilibrium.mechanism`.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, sqrt, total, where
from kinetostat.algebra.solve import Row, elimination, semidefinite_root
from kinetostat.algebra.symmetric import eigenvalues
from kinetostat.arrays import Array
from kinetostat.equilibrium.cut import Cut, ElasticRod, cut
from kinetostat.equilibrium.legwise import LegwiseTangent
from kinetostat.equilibrium.mechanism import Mechanism, mechanism_of, platform_weights
from kinetostat.equilibrium.reduced import place_of, relative
from kinetostat.equilibrium.solving import with_share
from kinetostat.equilibrium.state import MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints
from kinetostat.kinetostatics.quantities import MODES
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import values_of_drives
from kinetostat.machine.loads import PLATFORM, moving_masses
from kinetostat.machine.machine import Configuration, Machine
from kinetostat.machine.parameters import parameters
from kinetostat.numerics.motions import of_scalars, still
from kinetostat.tolerances import CLOSING_ROUND_OFF, UNRESISTED
from kinetostat.vibration.inertia import (
    leg_rates,
    mass_matrices,
    platform_inertia,
    platform_rates,
    twice_kinetic_energy,
)
from kinetostat.vibration.modes import frequencies, hertz, mass_matrix, motions_left_out, solved_modes, stiffness_matrix

EQUAL_INVERSE_SQUARES = 1e-9
"""Relative difference of 1 / omega² up to which two modes share one frequency: far above round-off, and far below the
difference of two parts that are meant to differ."""
KINDS_OF_MASS = ("mass", "inertia", "moment of inertia", "density", "linear density")
"""Kinds of quantities that give a part a mass."""
MASSES_BESIDE_LEGS = ("tool", "cables")
"""Tables whose masses are not those of links and rotors: of the platform with its payload, and of cables, which are
weightless here."""
SPARE_MODES = 5
"""Modes beyond the last one that is wanted: equal frequencies share their mean, so that equal ones must be known."""


def reducible(machine: Machine, varying: Collection[str] = ()) -> bool:
    """Whether `frequencies_over_scalars` can compute a machine at all values of its varying parameters (leaf paths)."""
    state = state_of(machine)
    with np.errstate(all="ignore"):
        if platform_alone(state, varying):
            return True
        machine_cut = cut(state.free_equations.mechanism)
        return machine_cut is not None and not machine_cut.legs and not leaves_plane(machine, machine_cut)


def leaves_plane(machine: Machine, machine_cut: Cut) -> bool:
    """Whether springs of a planar machine may deflect out of its plane, a motion that these sums do not exclude."""
    return machine.family.planar and any(spring is not None for spring in machine_cut.carrier.springs)


def platform_alone(machine: Machine | MachineState, varying: Collection[str] = ()) -> bool:
    """Whether no leg has a mass or a rotor at any value of the varying parameters (leaf paths)."""
    state = state_of(machine)
    if not _paths_of_leg_masses(state.machine).isdisjoint(varying):
        return False
    return legs_without_mass(state.machine, state.configuration)


def _paths_of_leg_masses(machine: Machine) -> set[str]:
    """Return the leaf paths of the parameters that may give links or rotors a mass."""
    masses = (p for p in parameters(machine.family) if p.quantity.kind in KINDS_OF_MASS)
    return {leaf for p in masses if p.path.partition(".")[0] not in MASSES_BESIDE_LEGS for leaf in p.leaves}


def legs_without_mass(machine: Machine, configuration: Configuration) -> bool:
    """Whether no leg has a mass or a rotor with inertia, as the form of the file says it."""
    links = [part for part in moving_masses(machine, configuration) if part.name != PLATFORM]
    return all(link.mass is None for link in links) and all(
        is_zero(inertia) for inertia in values_of_drives(machine, "drives.rotor_inertia")
    )


def frequencies_over_scalars(
    machine: Machine, response: Response, joints: Joints | None, sloped: bool = False
) -> list[Scalar]:
    """Return the lowest natural frequencies of a machine with relaxed springs, Hz [MODES]; infinite beyond the last.

    Args:
        machine: the machine with its masses, and numbers of any kind.
        response: the response of the machine at its pose.
        joints: coordinates that close its legs, if it is written leg by leg.
        sloped: whether derivatives will be taken, see `algebra.symmetric.eigenvalues`.
    """
    if legs_without_mass(machine, response.configuration):
        return sorted_frequencies(eigenvalues(platform_matrix(machine, response), sloped))
    # `reducible` says of which machines the loops are cut by rods alone.
    machine_cut = cut(with_share(mechanism_of(machine, response.configuration, joints, None), 0.0))
    if machine_cut is None or machine_cut.legs:
        raise ValueError("loops that rods do not cut have no frequencies over scalars")
    return frequencies_of_cut(machine_cut, [0.0] * machine_cut.carrier.size, sloped)


def numpy_frequencies(state: MachineState) -> Array:
    """Return natural frequencies of any machine at n poses, by NumPy, Hz [n x MODES]; NaN if springs do not hold it."""
    machine, response, count = state.machine, state.free, state.count
    if not legs_without_mass(machine, response.configuration):
        return frequencies(state.free_equations)
    entries = [entry for row in platform_matrix(machine, response) for entry in row]
    size = len(machine.family.components)
    matrices = of_scalars(entries, count).reshape(count, size, size)
    result = np.full((count, MODES), np.nan)
    sound = np.isfinite(matrices).all(axis=(1, 2))
    result[sound] = np.inf
    result[sound, :size] = hertz(np.asarray(np.linalg.eigvalsh(matrices[sound])[:, ::-1], dtype=float))
    return result


def platform_matrix(machine: Machine, response: Response) -> list[Row]:
    """Return the matrix G^T M G with C = G G^T, whose eigenvalues are those of C M, s²; rigid directions give zeros.

    Args:
        machine: a machine in which the platform alone is massive.
        response: the response of the machine at its pose.
    """
    parts, length = machine.family.components, response.configuration.length
    units = [length if part in range(3) else 1.0 for part in range(6)]  # so that all rows are in m/N and kg
    inertia = _platform_inertia(machine, response)
    compliance = [[response.compliance.entry(i, j) * units[i] * units[j] for j in parts] for i in parts]
    mass = [[inertia[i][j] * (1.0 / (units[i] * units[j])) for j in parts] for i in parts]
    factor = np.array(semidefinite_root(compliance), dtype=object)  # entries may be traced, and NumPy multiplies these
    return (factor.T @ np.array(mass, dtype=object) @ factor).tolist()


def _platform_inertia(machine: Machine, response: Response) -> list[Row]:
    """Return the mass matrix of platform and payload for twists of the tool point, base axes, SI [6][6]."""
    result: list[Row] = [[0.0 for _ in range(6)] for _ in range(6)]
    for weight in platform_weights(machine, response.configuration.platform):
        x, y, z = (weight.point - response.reference).components()
        mass, (xx, yy, zz, xy, xz, yz) = weight.mass, weight.inertia
        turning = [
            [xx + mass * (y * y + z * z), xy - mass * (x * y), xz - mass * (x * z)],
            [xy - mass * (x * y), yy + mass * (x * x + z * z), yz - mass * (y * z)],
            [xz - mass * (x * z), yz - mass * (y * z), zz + mass * (x * x + y * y)],
        ]
        lever = [[0.0, -(mass * z), mass * y], [mass * z, 0.0, -(mass * x)], [-(mass * y), mass * x, 0.0]]
        for i in range(3):
            result[3 + i][3 + i] = result[3 + i][3 + i] + mass
            for j in range(3):
                result[i][j] = result[i][j] + turning[i][j]
                result[i][3 + j] = result[i][3 + j] + lever[i][j]
                result[3 + j][i] = result[3 + j][i] + lever[i][j]
    return result


def frequencies_of_cut(machine_cut: Cut, coordinates: Row, sloped: bool = False) -> list[Scalar]:
    """Return the lowest natural frequencies at some coordinates of the carrier, Hz [MODES].

    Args:
        machine_cut: the machine with its loops cut; where legs close some, the platform alone is massive.
        coordinates: coordinates of its carrier at rest.
        sloped: whether derivatives will be taken, see `algebra.symmetric.eigenvalues`.
    """
    if machine_cut.legs:
        tangent, mechanism = LegwiseTangent(machine_cut, coordinates), machine_cut.mechanism
        inertia = platform_inertia(mechanism.platform, tangent.platform, mechanism.length)[0]
        stiff, mass = tangent.over_springs(inertia)
    else:
        stiff, mass = _matrices_over_carrier(machine_cut, coordinates)
    return sorted_frequencies(eigenvalues(relative(elimination(stiff.tolist()), mass), sloped))


def _matrices_over_carrier(machine_cut: Cut, coordinates: Row) -> tuple[Array, Array]:
    """Return K and M over the coordinates of the carrier of a machine whose loops are all cut at rods."""
    place, mechanism = place_of(machine_cut, coordinates), machine_cut.mechanism
    placed = machine_cut.carrier.chain.place(of_scalars(coordinates), mechanism.undriven_amounts)
    length, twists = mechanism.length, place.terms.rates[0]
    inertia = platform_inertia(mechanism.platform, place.platform, length)[0]
    for rod in machine_cut.rods:
        if not is_zero(rod.rotor):
            inertia = inertia + _stretch_dyad(rod, place.platform.point(rod.ends.far)) * (rod.rotor * length[0])
    mass = twists.T @ inertia @ twists
    for _, matrix in mass_matrices(machine_cut.carrier.masses, leg_rates(machine_cut.carrier, placed), length):
        mass = mass + matrix[0]
    return 0.5 * (place.rates + place.rates.T), mass + np.diag(machine_cut.carrier.rotors[0] * length[0])


def _stretch_dyad(rod: ElasticRod, far: Array) -> Array:
    """Return the dyad of the unit line of a rod to the point `far`: the square of its rate by a twist [6 x 6]."""
    span = (far - rod.ends.near)[0]
    length = sqrt(total([part * part for part in span]))
    direction = np.array([part * (1.0 / length) for part in span], dtype=object)
    line = np.concatenate([np.cross(far[0], direction), direction])
    return np.asarray(np.outer(line, line))


def sorted_frequencies(modes: Sequence[Scalar]) -> list[Scalar]:
    """Return the lowest natural frequencies in rising order, Hz [MODES]; equal ones share their mean.

    Args:
        modes: 1 / omega² of each mode, s², in any order.
    """
    inverse_squares, count = [*modes], len(modes)
    for turn in range(count):  # odd-even sort without branches: exchange neighbours until the largest come first
        for k in range(turn % 2, count - 1, 2):
            left, right = inverse_squares[k], inverse_squares[k + 1]
            swap = left < right
            inverse_squares[k], inverse_squares[k + 1] = where(swap, right, left), where(swap, left, right)
    largest = inverse_squares[:MODES]
    means = [_mean_of_equals(inverse_squares, each) for each in largest] + [0.0] * (MODES - len(largest))
    return [_frequency(mean, inverse_squares[0]) for mean in means]


def _mean_of_equals(inverse_squares: Sequence[Scalar], inverse_square: Scalar) -> Scalar:
    """Return the mean of all 1 / omega² that are equal to one of them, itself included."""
    equals = [abs(other - inverse_square) <= EQUAL_INVERSE_SQUARES * abs(inverse_square) for other in inverse_squares]
    sums = total([where(equal, other, 0.0) for equal, other in zip(equals, inverse_squares, strict=True)])
    return sums / total([where(equal, 1.0, 0.0) for equal in equals])


def _frequency(inverse_square: Scalar, largest: Scalar) -> Scalar:
    """Return the frequency of a mode by its 1 / omega², s²; infinite where that is round-off beside the largest one."""
    finite = inverse_square > UNRESISTED * largest
    return where(finite, 0.5 / math.pi / sqrt(where(finite, inverse_square, 1.0)), math.inf)


class KnownMode(NamedTuple):
    """A mode that is known, in the order of its columns.

    Attributes:
        inverse_square: 1 / omega², s².
        platform: rates of the platform along its ways.
        legs: rates of the coordinates of each leg.
        forces: forces that close each leg, along the ways.
    """

    inverse_square: Scalar
    platform: Row
    legs: list[Row]
    forces: list[Row]


def mode_columns(machine: Machine, count: int, most: int) -> list[Array]:
    """Return the lowest modes of a machine with relaxed springs at n poses as columns for `MachineOfKnownModes` [n].

    Args:
        machine: the machine, with columns of n poses.
        count: number of poses, n.
        most: number of modes; those that a pose does not have are zero.

    Returns:
        The unit of force, then for each mode the numbers of a `KnownMode`. NaN where springs do not hold the machine.
    """
    equations = MachineState(machine, count).free_equations
    stiff, conditions = stiffness_matrix(equations)
    mass, closing_count = mass_matrix(equations), conditions.shape[1]
    constraints = np.concatenate([conditions, motions_left_out(equations, mass)], axis=1)
    columns = np.full((count, most, 1 + stiff.shape[1] + closing_count), np.nan)
    for part in solved_modes(equations):
        known = min(most, part.inverse_squares.shape[1])
        inverse_squares, shapes = part.inverse_squares[:, :known], part.shapes[:, :, :known]
        # Along allowed motions mu K y = M y; across them, the forces of the constraints balance the difference.
        imbalance = stiff[part.rows] @ shapes * inverse_squares[:, None] - mass[part.rows] @ shapes
        forces = np.linalg.pinv(constraints[part.rows].mT, rcond=CLOSING_ROUND_OFF) @ imbalance
        numbers = np.concatenate([inverse_squares[:, None], shapes, forces[:, :closing_count]], axis=1)
        columns[part.rows] = 0.0
        columns[part.rows, :known] = numbers.mT
    return [equations.mechanism.force, *np.ascontiguousarray(columns.reshape(count, -1).T)]


@dataclass(frozen=True)
class MachineOfKnownModes:
    """A machine with relaxed springs whose modes are known, over scalars.

    Attributes:
        mechanism: the machine as coordinates and masses.
        most: number of modes that are known.
    """

    mechanism: Mechanism
    most: int

    @property
    def columns(self) -> int:
        """Number of columns that `mode_columns` makes of it."""
        closing_count = self.mechanism.ways.shape[1] * len(self.mechanism.legs)
        return 1 + self.most * (1 + self.mechanism.motion_places.count + closing_count)

    def inverse_squares(self, columns: Sequence[Scalar]) -> list[Scalar]:
        """1 / omega² of each mode, s² [most]: exact, as their derivatives by the machine's parameters are.

        Args:
            columns: the columns that `mode_columns` makes.
        """
        force_unit, *numbers = columns
        force_ratio, remaining = self.mechanism.force[0] / force_unit, iter(numbers)
        return [self._inverse_square(self._next_mode(remaining), force_ratio) for _ in range(self.most)]

    def _next_mode(self, numbers: Iterator[Scalar]) -> KnownMode:
        """Take a mode off the numbers of several."""
        ways, legs = self.mechanism.ways.shape[1], self.mechanism.legs
        return KnownMode(
            inverse_square=next(numbers),
            platform=[*islice(numbers, ways)],
            legs=[[*islice(numbers, leg.size)] for leg in legs],
            forces=[[*islice(numbers, ways)] for _ in legs],
        )

    def _inverse_square(self, mode: KnownMode, force_ratio: Scalar) -> Scalar:
        """Return mu + r (y^T M y - mu y^T K y) + 2 f . g for one mode y, with mu = 1 / omega².

        f are the forces that close the legs, g the gaps that y opens, and r is the ratio of the units of force of this
        machine and of the one whose mode it is. At the known mode all but mu vanishes; its derivatives do not.
        """
        mechanism = self.mechanism
        twist = mechanism.ways @ of_scalars(mode.platform)[0]
        platform = mechanism.platform
        kinetic = twice_kinetic_energy(platform, platform_rates(platform, still(1)), twist, mechanism.length)
        strain, opening_work = 0.0, 0.0
        amounts = np.zeros((1, len(mechanism.actuators) + mechanism.growth.shape[1]))  # relaxed links have not grown
        for leg, rates, force in zip(mechanism.legs, mode.legs, mode.forces, strict=True):
            motion = of_scalars(rates)[0]
            placed = leg.chain.place(np.zeros((1, leg.size)).astype(object), amounts.astype(object))
            kinetic = kinetic + twice_kinetic_energy(leg.masses, leg_rates(leg, placed), motion, mechanism.length)
            kinetic = kinetic + mechanism.length[0] * total(list(leg.rotors[0] * motion * motion))
            strain = strain + total(list(leg.stiffness[0] * motion * motion))
            end_twist = placed.screws[0].T @ (leg.chain.follows @ motion)
            opening_work = opening_work + total(list(mechanism.ways @ force * (end_twist - twist)))
        return mode.inverse_square + force_ratio * (kinetic - mode.inverse_square * strain) + 2.0 * opening_work


def machine_of_known_modes(
    machine: Machine, response: Response, joints: Joints | None, most: int
) -> MachineOfKnownModes:
    """Return a machine with numbers of any kind, whose modes will be known.

    Args:
        machine: the machine with its masses.
        response: the response of the machine at its pose.
        joints: coordinates that close its legs, if it is written leg by leg.
        most: number of modes.
    """
    return MachineOfKnownModes(with_share(mechanism_of(machine, response.configuration, joints, None), 0.0), most)
