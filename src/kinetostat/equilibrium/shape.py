"""Where the links of a machine at rest under load are, for drawings. Nothing is solved here.

Source: theory (35).
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from kinetostat.algebra.screw import Twist
from kinetostat.algebra.vector import Vector
from kinetostat.equilibrium.balance import Balance
from kinetostat.kinetostatics.deflected import DeflectedLink, leg_links
from kinetostat.machine.leg import Leg
from kinetostat.numerics.motions import Motions


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
    for leg, elastic, coordinates in zip(legs, mechanism.legs, state.coordinates, strict=True):
        placed = elastic.chain.placed(coordinates, given).before
        bodies = [placed[number] for number in elastic.ends]
        links += leg_links(leg, partial(_moved, bodies, origin, length))
    return tuple(links)


def _moved(bodies: Sequence[Motions], origin: Vector, length: float, body: int, point: Vector) -> Twist:
    """How a point (m) of one of the bodies moves, rad and m."""
    at = np.array([(point - origin).components()], dtype=float) / length
    turned = Vector(*bodies[body].amounts()[0, :3].tolist())
    return Twist(turned, Vector(*(length * (bodies[body].point(at) - at))[0].tolist()))
