"""Parts in a vibration: shares of its strain energy by spring, of its kinetic energy by part, of all mass.

The strain energy of each motion is one half in units of the mechanism, its kinetic energy too: shares add up to 1.

Source: theory (58), and what follows it. Units are those of `equilibrium.mechanism`.
"""

from itertools import pairwise

import numpy as np

from kinetostat.arrays import Array
from kinetostat.equilibrium.admissible import starts_of, tangent_matrices
from kinetostat.equilibrium.balance import Balance
from kinetostat.vibration.inertia import energies, leg_rates, platform_rates
from kinetostat.vibration.modes import Modes

TURNING_LOADS = "weight and wrenches as they turn"
"""Names the share of the strain energy that no spring has."""


def strain_shares(equations: Balance, shapes: Array) -> dict[str, Array]:
    """Shares of the strain energy by spring [modes]; wrenches and weights that turn have what is left."""
    elastic, geometric, _ = tangent_matrices(equations)
    shares: dict[str, Array] = {}
    for leg, (first, _last) in zip(equations.mechanism.legs, pairwise(starts_of(equations)), strict=True):
        for number, spring in enumerate(leg.springs):
            if spring is not None:
                place = first + number
                amount = elastic[0, place, place] * shapes[place] ** 2
                name = spring.name
                shares[name] = shares.get(name, np.zeros(shapes.shape[1])) + amount
    turning = np.einsum("ik,ij,jk->k", shapes, geometric[0], shapes)
    return shares | ({TURNING_LOADS: turning} if np.abs(turning).max(initial=0.0) > 0.0 else {})


def kinetic_shares(equations: Balance, solution: Modes) -> dict[str, Array]:
    """Shares of the kinetic energy by part, of all modes that ring [modes]."""
    mechanism, starts = equations.mechanism, starts_of(equations)
    shapes, squares = solution.shapes[:, : solution.ringing], solution.squares[: solution.ringing]
    size, length = mechanism.ways.shape[1], mechanism.length
    shares: dict[str, Array] = {}

    def add(name: str, matrix: Array, moved: Array) -> None:
        shares[name] = shares.get(name, 0.0) + np.einsum("ik,ij,jk->k", moved, matrix, moved) / squares

    moved = mechanism.ways @ shapes[:size]
    for name, matrix in energies(
        mechanism.platform, platform_rates(mechanism.platform, equations.state.platform), length
    ):
        add(name, matrix[0], moved)
    given = np.concatenate([equations.state.amounts, mechanism.growth], axis=1)
    pairs = zip(mechanism.legs, equations.state.coordinates, pairwise(starts), strict=True)
    for leg, coordinates, (first, last) in pairs:
        placed = leg.chain.place(coordinates, given)
        for name, matrix in energies(leg.masses, leg_rates(leg, placed), length):
            add(name, matrix[0], shapes[first:last])
        for number, spring in enumerate(leg.springs):
            if spring is not None and leg.rotors[0, number]:
                rotor = leg.rotors[:, number] * length
                add(f"rotor of {spring.name}", rotor[None], shapes[first + number : first + number + 1])
    return shares


def effective_masses(equations: Balance, solution: Modes) -> list[tuple[float, float, float]]:
    """Squares of the momentum of each mode along x, y, z as shares of all moving mass."""
    mechanism, starts = equations.mechanism, starts_of(equations)
    size, shapes = mechanism.ways.shape[1], solution.shapes[:, : solution.ringing]
    momentum, whole = np.zeros((3, solution.ringing)), 0.0
    moved = mechanism.ways @ shapes[:size]
    rates = platform_rates(mechanism.platform, equations.state.platform)
    for mass, part in zip(mechanism.platform.mass[0], rates, strict=True):
        momentum, whole = momentum + mass * (part.moving[0] @ moved), whole + mass
    given = np.concatenate([equations.state.amounts, mechanism.growth], axis=1)
    pairs = zip(mechanism.legs, equations.state.coordinates, pairwise(starts), strict=True)
    for leg, coordinates, (first, last) in pairs:
        for mass, part in zip(leg.masses.mass[0], leg_rates(leg, leg.chain.place(coordinates, given)), strict=True):
            momentum, whole = momentum + mass * (part.moving[0] @ shapes[first:last]), whole + mass
    scaled = momentum**2 / np.sqrt(solution.squares[: solution.ringing]) ** 2 * float(mechanism.length[0])
    shares = scaled / whole if whole else scaled
    return [(float(x), float(y), float(z)) for x, y, z in shares.T]
