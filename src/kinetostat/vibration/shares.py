"""The parts of a machine in a mode: their shares of strain energy, kinetic energy and momentum, and their motions.

The strain energy of each mode is one half in units of the mechanism, and so is its kinetic energy: shares add up to 1.

Source: theory (58), and what follows it. Units are those of `equilibrium.mechanism`.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from kinetostat.algebra.screw import NO_WRENCH, Twist
from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import Balance, loaded_links
from kinetostat.equilibrium.elastic_legs import ElasticLeg, Masses
from kinetostat.equilibrium.tangent import starts_of, tangent_matrices
from kinetostat.kinetostatics.loading import Deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.tolerances import LEAST_DIVISOR
from kinetostat.vibration.inertia import PartRates, leg_rates, mass_matrices, platform_rates
from kinetostat.vibration.modes import Modes

TURNING_LOADS = "weight and wrenches as they turn"
"""Name of the share of the strain energy that no spring has."""
SMALL_MOTION = 1e-6
"""Size of the motion by which shapes are read off the exact motions of the links, rad or in machine lengths: its square
is what curvature adds, and its reciprocal times 1e-16 what round-off adds."""


def strain_shares(equations: Balance, shapes: Array) -> dict[str, Array]:
    """Return shares of the strain energy by spring [modes]; wrenches and weights that turn have the rest."""
    elastic, geometric, _ = tangent_matrices(equations)
    shares: dict[str, Array] = {}
    for leg, first in zip(equations.mechanism.legs, starts_of(equations)[:-1], strict=True):
        for number, spring in enumerate(leg.springs):
            if spring is not None:
                place = first + number
                amount = elastic[0, place, place] * shapes[place] ** 2
                shares[spring.name] = shares.get(spring.name, 0.0) + amount
    # The rest is the work of loads whose directions turn with the motion.
    turning = np.einsum("ik,ij,jk->k", shapes, geometric[0], shapes)
    return shares | ({TURNING_LOADS: turning} if np.abs(turning).max(initial=0.0) > 0.0 else {})


def kinetic_shares(equations: Balance, solution: Modes) -> dict[str, Array]:
    """Return shares of the kinetic energy by part, of all modes with mass [modes]."""
    inverse_squares = solution.inverse_squares[: solution.ringing]
    shares: dict[str, Array] = {}

    def add(name: str, matrix: Array, motions: Array) -> None:
        shares[name] = shares.get(name, 0.0) + np.einsum("ik,ij,jk->k", motions, matrix, motions) / inverse_squares

    for masses, rates, motions, leg in _moving_parts(equations, solution):
        for name, matrix in mass_matrices(masses, rates, equations.mechanism.length):
            add(name, matrix[0], motions)
        if leg is None:
            continue
        for number, spring in enumerate(leg.springs):
            if spring is not None and leg.rotors[0, number]:
                rotor = leg.rotors[:, number] * equations.mechanism.length
                add(f"rotor of {spring.name}", rotor[None], motions[number : number + 1])
    return shares


def effective_masses(equations: Balance, solution: Modes) -> list[tuple[float, float, float]]:
    """Return squares of the momentum of each mode along x, y, z as shares of all moving mass."""
    momentum, moving_mass = np.zeros((3, solution.ringing)), 0.0
    for masses, rates, motions, _ in _moving_parts(equations, solution):
        for mass, part in zip(masses.mass[0], rates, strict=True):
            momentum, moving_mass = momentum + mass * (part.velocity[0] @ motions), moving_mass + mass
    scaled = momentum**2 / solution.inverse_squares[: solution.ringing] * float(equations.mechanism.length[0])
    shares = scaled / moving_mass if moving_mass else scaled
    return [(float(x), float(y), float(z)) for x, y, z in shares.T]


def _moving_parts(
    equations: Balance, solution: Modes
) -> Iterator[tuple[Masses, list[PartRates], Array, ElasticLeg | None]]:
    """Give the masses of the platform and of each leg, their rates, and the modes over the coordinates of these rates.

    Returns:
        Masses, rates, modes [coordinates x modes], and the leg; None for the platform.
    """
    mechanism, state, shapes = equations.mechanism, equations.state, solution.shapes[:, : solution.ringing]
    rates = platform_rates(mechanism.platform, state.platform)
    yield mechanism.platform, rates, mechanism.ways @ shapes[: mechanism.ways.shape[1]], None
    amounts = np.concatenate([state.amounts, mechanism.growth], axis=1)
    ends = pairwise(starts_of(equations))
    for leg, coordinates, (first, last) in zip(mechanism.legs, state.coordinates, ends, strict=True):
        yield leg.masses, leg_rates(leg, leg.chain.place(coordinates, amounts)), shapes[first:last], leg


def small_motions(response: Response, equations: Balance, solution: Modes, number: int) -> Deflection:
    """Return the motions of the tool and of the ends of all links in a mode, for drawings.

    They are differences of the exact motions of the links after a displacement so small that it is one to first order.

    Args:
        response: the response of the machine, whose legs are drawn.
        equations: the state about which it vibrates.
        solution: all modes.
        number: the number of the mode, from 0.
    """
    starts, shape, state = starts_of(equations), solution.shapes[:, number], equations.state
    amount = SMALL_MOTION / max(float(np.abs(shape).max()), LEAST_DIVISOR)
    displaced = tuple(
        coordinates + amount * shape[None, first:last]
        for coordinates, (first, last) in zip(state.coordinates, pairwise(starts), strict=True)
    )
    displaced_equations = replace(equations, state=replace(state, coordinates=displaced))
    legs, origin = response.configuration.legs, response.reference
    links_before, links_after = (loaded_links(balanced, legs, origin) for balanced in (equations, displaced_equations))
    joule = float(equations.mechanism.force[0] * equations.mechanism.length[0])
    tool = (solution.tool[:, number] * amount * math.sqrt(joule)).tolist()
    return Deflection(
        NO_WRENCH,
        Twist(Vector(*tool[:3]), Vector(*tool[3:])),
        tuple(
            replace(
                link,
                start_motion=link.start_motion - before.start_motion,
                end_motion=link.end_motion - before.end_motion,
            )
            for before, link in zip(links_before, links_after, strict=True)
        ),
    )
