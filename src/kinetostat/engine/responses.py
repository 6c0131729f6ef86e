"""Whole responses of a machine at many points, as arrays: for questions that ask more than some numbers of each.

Some thousand points; large grids of single quantities go through `batch`. Holds no formula.
"""

import numpy as np

from kinetostat.engine.points import Points
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import with_values


def responses(machine: Machine, points: Points) -> Response:
    """The response of a machine at all points: every scalar in it is an array [points] or the same at all of them.

    Results are meaningless where the status is not OK.

    Args:
        machine: gives all parameters that do not vary.
        points: where; leaf paths of the machine's family and their values, SI.
    """
    with np.errstate(all="ignore"):
        return respond(with_values(machine, points.columns(0, points.size)))
