"""The parts of a machine in a mode: their shares of strain energy, kinetic energy and momentum, and their motions.

The strain energy of each mode is one half in units of the mechanism, and so is its kinetic energy: shares add up to 1.

Source: theory (58), and what follows it. Units are those of `equilibrium.mechanism`.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kinetostat.algebra.screw import NO_WRENCH, Twist
from kinetostat.arrays import Array
from kinetostat.equilibrium.balance import Balance, loaded_links
from kinetostat.equilibrium.elastic_legs import ElasticLeg, Masses
from kinetostat.equilibrium.tangent import tangent_matrices
from kinetostat.kinetostatics.loading import Deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.tolerances import LEAST_DIVISOR
from kinetostat.vibration.inertia import PartRates, leg_rates, mass_matrices, platform_rates
from kinetostat.vibration.modes import Modes

TURNING_LOADS = "weight and wrenches as they turn"
"""Share of the strain energy that no spring has: the work of weights and wrenches, whose directions turn with the
motion."""
SMALL_MOTION = 1e-6
"""Size of the motion by which shapes are read off the exact motions of the links, rad or in machine lengths: its square
is what curvature adds, and its reciprocal times 1e-16 what round-off adds."""


def strain_shares(equations: Balance, shapes: Array) -> dict[str, Array]:
    """Return shares of the strain energy by spring [modes]; `TURNING_LOADS` have the rest, if there is one."""
    mechanism, matrices = equations.mechanism, tangent_matrices(equations)
    shares: dict[str, Array] = {}
    for leg, places in zip(mechanism.legs, mechanism.motion_places.coordinates, strict=True):
        for place, spring in enumerate(leg.springs, places.start):
            if spring is not None:
                amount = matrices.elastic[0, place, place] * shapes[place] ** 2
                shares[spring.name] = shares.get(spring.name, 0.0) + amount
    turning = np.einsum("ik,ij,jk->k", shapes, matrices.geometric[0], shapes)
    return shares | ({TURNING_LOADS: turning} if np.abs(turning).max(initial=0.0) > 0.0 else {})


def kinetic_shares(equations: Balance, solution: Modes) -> dict[str, Array]:
    """Return shares of the kinetic energy by part, of all modes with mass [modes]."""
    inverse_squares = solution.inverse_squares[: solution.mode_count]
    shares: dict[str, Array] = {}

    def add(name: str, matrix: Array, motions: Array) -> None:
        shares[name] = shares.get(name, 0.0) + np.einsum("ik,ij,jk->k", motions, matrix, motions) / inverse_squares

    for part in _moving_parts(equations, solution):
        for name, matrix in mass_matrices(part.masses, part.rates, equations.mechanism.length):
            add(name, matrix[0], part.motions)
        if part.leg is None:
            continue
        for number, spring in enumerate(part.leg.springs):
            if spring is not None and part.leg.rotors[0, number]:
                rotor = part.leg.rotors[:, number] * equations.mechanism.length
                add(f"rotor of {spring.name}", rotor[None], part.motions[number : number + 1])
    return shares


def effective_masses(equations: Balance, solution: Modes) -> list[tuple[float, float, float]]:
    """Return squares of the momentum of each mode along x, y, z as shares of all moving mass."""
    momentum, moving_mass = np.zeros((3, solution.mode_count)), 0.0
    for part in _moving_parts(equations, solution):
        for mass, rates in zip(part.masses.mass[0], part.rates, strict=True):
            momentum, moving_mass = momentum + mass * (rates.velocity[0] @ part.motions), moving_mass + mass
    scaled = momentum**2 / solution.inverse_squares[: solution.mode_count] * float(equations.mechanism.length[0])
    shares = scaled / moving_mass if moving_mass else scaled
    return [(float(x), float(y), float(z)) for x, y, z in shares.T]


class _MovingPart(NamedTuple):
    """The platform or a leg with its masses in all modes that have mass.

    Attributes:
        masses: its masses.
        rates: motion of each mass by the rates of the coordinates.
        motions: the modes over these coordinates [coordinates x modes].
        leg: the leg; None for the platform, whose coordinates are the six of its twist.
    """

    masses: Masses
    rates: list[PartRates]
    motions: Array
    leg: ElasticLeg | None


def _moving_parts(equations: Balance, solution: Modes) -> Iterator[_MovingPart]:
    """Give the platform, and then each leg."""
    mechanism, state, shapes = equations.mechanism, equations.state, solution.shapes[:, : solution.mode_count]
    places = mechanism.motion_places
    rates = platform_rates(mechanism.platform, state.platform)
    yield _MovingPart(mechanism.platform, rates, mechanism.ways @ shapes[places.platform], None)
    for leg, coordinates, moving in zip(mechanism.legs, state.coordinates, places.coordinates, strict=True):
        placed = leg.chain.place(coordinates, mechanism.given_amounts(state.amounts))
        yield _MovingPart(leg.masses, leg_rates(leg, placed), shapes[moving], leg)


def small_motions(response: Response, equations: Balance, solution: Modes, number: int) -> Deflection:
    """Return the motions of the tool and of the ends of all links in a mode, for drawings.

    Each is the difference of the exact places of a link's end before and after a tiny displacement along the mode.

    Args:
        response: the response of the machine, whose legs are drawn.
        equations: the state about which it vibrates.
        solution: all modes.
        number: the number of the mode, from 0.
    """
    mechanism, state, shape = equations.mechanism, equations.state, solution.shapes[:, number]
    amount = SMALL_MOTION / max(float(np.abs(shape).max()), LEAST_DIVISOR)
    displaced = tuple(
        coordinates + amount * shape[None, moving]
        for coordinates, moving in zip(state.coordinates, mechanism.motion_places.coordinates, strict=True)
    )
    displaced_equations = replace(equations, state=replace(state, coordinates=displaced))
    legs, origin = response.configuration.legs, response.reference
    links_before, links_after = (loaded_links(balanced, legs, origin) for balanced in (equations, displaced_equations))
    # Shapes are per root of the mechanism's unit of energy, and `tool` is per root of a joule: this is that unit, J.
    energy_unit = float(mechanism.force[0] * mechanism.length[0])
    tool = (solution.tool[:, number] * amount * math.sqrt(energy_unit)).tolist()
    return Deflection(
        NO_WRENCH,
        Twist.of(tool),
        tuple(
            replace(
                link,
                start_motion=link.start_motion - before.start_motion,
                end_motion=link.end_motion - before.end_motion,
            )
            for before, link in zip(links_before, links_after, strict=True)
        ),
    )
