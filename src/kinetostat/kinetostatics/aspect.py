"""The aspect of a pose: a sign that differs on the two sides of every singular surface of a machine.

Two poses of different aspect can be joined only through a singularity. Nothing here decides where a workspace ends.

Source: theory (30).
"""

from kinetostat.algebra.scalar import Scalar, reciprocal
from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.solve import handedness
from kinetostat.algebra.symmetric import SIZE
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.leg import comparable


def aspect(response: Response) -> Scalar:
    """Return +1 or -1, different on the two sides of every singular surface; 0 if no such surface divides poses.

    The sign of det W, with the wrenches of each leg so oriented that they move continuously with its passive joints. It
    changes where the platform becomes free with locked actuators and where passive joints lock up. Legs that carry more
    than six wrenches lose rank on less than a surface, around which a machine can go.
    """
    wrenches = [wrench for leg in response.legs for wrench in leg.wrenches] + list(response.guide)
    if len(wrenches) != SIZE:
        return 0.0
    shrink = reciprocal(response.configuration.length)
    scaled = [Wrench(wrench.rotational * shrink, wrench.translational).components() for wrench in wrenches]
    sign = handedness(scaled)
    for leg, screws in zip(response.configuration.legs, response.legs, strict=True):
        if not leg.lines:
            needed = [twist for i, twist in enumerate(screws.passive) if i not in leg.idle]
            sign = sign * handedness([comparable(twist, shrink) for twist in needed])
    return sign
