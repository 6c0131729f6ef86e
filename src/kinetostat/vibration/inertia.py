"""The mass matrix of a mechanism at a state: kinetic energy by the rates of its platform and of its legs' coordinates.

A part moves with the screws of the motions that carry it. A uniform bar is straight between its ends, and its kinetic
energy follows from the velocities of both ends, so that it needs no coordinates of its own; spin about its axis does
not count. Arrays have the poses first, or hold scalars of any kind for one pose. Nothing is solved here.

Source: theory (55)-(57). Units are those of `equilibrium.mechanism`; masses are multiplied by the length, so that
eigenvalues are in 1/s².
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kinetostat.algebra.scalar import Scalar, is_zero, total
from kinetostat.arrays import Array
from kinetostat.equilibrium.elastic_legs import ElasticLeg, Masses
from kinetostat.frozen import dataclass
from kinetostat.kinematics.chain import PlacedChain
from kinetostat.numerics.motions import Motions, cross, skew_of

TENSOR_ROWS = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
"""Places of the rows of an inertia tensor among xx, yy, zz, xy, xz, yz."""


@dataclass(frozen=True)
class PartRates:
    """Motion of a mass by the rates of some coordinates.

    Attributes:
        velocity: velocity of its point per unit of each rate [n x 3 x coordinates].
        angular: angular velocity of its body per unit of each rate [n x 3 x coordinates].
        tensor: inertia about its point [n x 3 x 3]; None if it has none.
    """

    velocity: Array
    angular: Array
    tensor: Array | None


def tensor_of(masses: Masses, number: int, motion: Motions) -> Array | None:
    """Return the inertia of a mass about its point, displaced from the free state [n x 3 x 3]; None if it has none."""
    entries = masses.inertia[:, number]
    if _are_zero(entries):
        return None
    rows = np.stack([entries[:, list(row)] for row in TENSOR_ROWS], axis=1)
    return np.asarray(motion.rotation @ rows @ motion.rotation.mT)


def _are_zero(entries: Array) -> bool:
    """Tell whether all entries are zero: numbers by their value, scalars of other kinds by their form."""
    if entries.dtype == object:
        return all(map(is_zero, entries.flat))
    return not entries.any()


def leg_rates(leg: ElasticLeg, placed: PlacedChain) -> list[PartRates]:
    """Return the motion of each mass of a leg by the rates of the leg's coordinates."""
    follows = leg.chain.follows
    rates = []
    for number, motions in enumerate(leg.masses.carried):
        carrier, screws = placed.before[motions], placed.screws[:, :motions]
        point = carrier.point(leg.masses.point[:, number])
        velocities = cross(screws[..., :3], point[:, None]) + screws[..., 3:]
        velocity, angular = (part.mT @ follows[:motions] for part in (velocities, screws[..., :3]))
        rates.append(PartRates(velocity, angular, tensor_of(leg.masses, number, carrier)))
    return rates


def platform_rates(masses: Masses, platform: Motions) -> list[PartRates]:
    """Return the motion of each mass of the platform by its twist, at the origin."""
    rates = []
    for number in range(len(masses.carried)):
        point = platform.point(masses.point[:, number])
        ones = np.broadcast_to(np.eye(3), (len(point), 3, 3))
        velocity = np.concatenate([-skew_of(point), ones], axis=2)
        angular = np.concatenate([ones, np.zeros((len(point), 3, 3))], axis=2)
        rates.append(PartRates(velocity, angular, tensor_of(masses, number, platform)))
    return rates


def mass_matrices(masses: Masses, rates: Sequence[PartRates], length: Array) -> Iterator[tuple[str, Array]]:
    """Give the mass matrices of parts, which add up to that of all.

    Args:
        masses: the masses.
        rates: the motion of each.
        length: unit of length of the mechanism, m [n].

    Returns:
        The name of a part, and its matrix [n x coordinates x coordinates].
    """
    for name, part, uncoupled in zip(masses.names, rates, (masses.uncoupled * length[:, None]).T, strict=True):
        matrix = part.velocity.mT @ part.velocity * uncoupled[:, None, None]
        if part.tensor is not None:
            rotary = part.angular.mT @ part.tensor @ part.angular
            matrix = matrix + rotary * length[:, None, None]
        yield name, matrix
    coupled = (masses.mass - masses.uncoupled) * length[:, None]
    for first, second in masses.pairs:
        product = rates[first].velocity.mT @ rates[second].velocity
        yield masses.names[first], (product + product.mT) * coupled[:, first, None, None]


def twice_kinetic_energy(masses: Masses, rates: Sequence[PartRates], motion: Array, length: Array) -> Scalar:
    """Return twice the kinetic energy of some masses in a motion of their coordinates; see `mass_matrices`."""
    along_motion = [
        replace(part, velocity=(part.velocity @ motion)[..., None], angular=(part.angular @ motion)[..., None])
        for part in rates
    ]
    return total([matrix[0, 0, 0] for _, matrix in mass_matrices(masses, along_motion, length)])


def platform_inertia(masses: Masses, platform: Motions, length: Array) -> Array:
    """Return the mass matrix of the platform by its twist, at the origin [n x 6 x 6]; `length` as in `mass_matrices`.

    It is the sum of the `mass_matrices` of `platform_rates`, without products with zeros and ones, for which traced
    programs would pay. No mass of the platform is a bar, so that no two are coupled.
    """
    count = len(length)
    kind = object if masses.mass.dtype == object or platform.translation.dtype == object else float
    tensor, first_moment, mass = (np.zeros(shape).astype(kind) for shape in ((count, 3, 3), (count, 3), count))
    for number, uncoupled in enumerate((masses.uncoupled * length[:, None]).T):
        point = platform.point(masses.point[:, number])
        lever = skew_of(point)
        tensor = tensor - lever @ lever * uncoupled[:, None, None]
        first_moment, mass = first_moment + point * uncoupled[:, None], mass + uncoupled
        tensor_of_mass = tensor_of(masses, number, platform)
        tensor = tensor if tensor_of_mass is None else tensor + tensor_of_mass * length[:, None, None]
    coupling, diagonal = skew_of(first_moment), np.eye(3) * mass[:, None, None]
    rows = np.concatenate([tensor, coupling], axis=2), np.concatenate([-coupling, diagonal], axis=2)
    return np.concatenate(rows, axis=1)
