"""Where the links of a machine at rest under load are, for drawings. Nothing is solved here.

Source: theory (35).
"""

from collections.abc import Iterator

import numpy as np

from kinetostat.algebra.scalar import is_zero
from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.chains import Chain
from kinetostat.equilibrium.motion import Array, Motions, exponential, still
from kinetostat.kinetostatics.deflected import DeflectedLink, leg_links
from kinetostat.machine.leg import Element, Leg


def loaded_links(equations: Balance, legs: tuple[Leg, ...], origin: Vector) -> tuple[DeflectedLink, ...]:
    """All links of a machine at one pose, with the exact motions of their ends.

    Args:
        equations: at the state of rest of one pose.
        legs: of the machine without loads.
        origin: its tool point there, m.
    """
    mechanism, state = equations.mechanism, equations.state
    length = float(mechanism.length[0])
    links: list[DeflectedLink] = []
    given = np.concatenate([state.amounts, mechanism.growth], axis=1)
    for leg, chain, coordinates in zip(legs, mechanism.legs, state.coordinates, strict=True):
        bodies = list(_bodies(leg, chain, coordinates, given))

        def moved(body: int, point: Vector, bodies: list[Motions] = bodies) -> Twist:
            at = np.array([(point - origin).components()], dtype=float) / length
            turned = Vector(*bodies[body].amounts()[0, :3].tolist())
            return Twist(turned, Vector(*(length * (bodies[body].point(at) - at))[0].tolist()))

        links += leg_links(leg, moved)
    return tuple(links)


def _bodies(leg: Leg, chain: Chain, coordinates: Array, given: Array) -> Iterator[Motions]:
    """Displacements of the bodies before, between and after the elements of a leg."""
    placed, number, known = still(1), 0, 0
    yield placed
    for element in leg.chain:
        known += _size(element)
        while number < len(chain.coordinate) and chain.coordinate[number] < known:
            by = chain.coordinate[number]
            amount = given[:, chain.given[number]] if by < 0 else coordinates[:, by]
            placed = placed @ exponential(chain.twists[:, number] * amount[:, None])
            number += 1
        yield placed


def _size(element: Element) -> int:
    """How many coordinates an element has: none for a rigid spring."""
    springs = [spring.stiffness for spring in element.springs]
    return len(element.freedoms) + sum(is_zero(k) or not np.isinf(float(k)) for k in springs)
