"""A machine at a pose to K, C and a status: the whole derivation in one function, for one pose.

It holds for floats (one pose), for NumPy arrays and, traced by the engine, for millions; results where the status is
not OK are meaningless and are masked by whoever collects them.
"""

from dataclasses import dataclass

from kinetostat.algebra.scalar import Scalar, smaller, where
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.kinematics.reach import within_reach
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, solve_statics, stiffness_matrix
from kinetostat.machine.leg import LegScrews
from kinetostat.machine.machine import Configuration, Machine

SINGULAR = 1e-7
"""Regularity below which a pose counts as singular: results have then lost half of their digits. A leg exactly at its
limit comes out at the square root of rounding, 1e-8, not at zero."""


@dataclass(frozen=True)
class Response:
    """What a machine answers at a pose.

    Attributes:
        configuration: where everything is.
        legs: screws of every leg at P, base axes.
        statics: how the springs share loads.
        stiffness, compliance: K (N·m/rad, N/rad, N/m) and C (rad/(N·m), rad/N, m/N) at P, base axes.
        regularity: distance from a singularity, 0 to 1 (dimensionless); the smaller of the legs' and the platform's.
        status: a `Status` code.
    """

    configuration: Configuration
    legs: tuple[LegScrews, ...]
    statics: Statics
    stiffness: Symmetric6
    compliance: Symmetric6
    regularity: Scalar
    status: Scalar


def respond(machine: Machine) -> Response:
    """K, C and status of a machine at its pose."""
    configuration = machine.configure()
    reference, length = configuration.platform.translation, configuration.length
    legs = tuple(leg.screws(reference, length) for leg in configuration.legs)
    statics = solve_statics(legs, length)
    regularity: Scalar = 1.0
    for leg in legs:
        regularity = smaller(regularity, leg.regularity)
    regularity = smaller(regularity, statics.regularity)
    return Response(
        configuration,
        legs,
        statics,
        stiffness_matrix(statics),
        compliance_matrix(statics),
        regularity,
        pose_status(within_reach(configuration), regularity),
    )


def pose_status(reached: Scalar, regularity: Scalar) -> Scalar:
    """Status code of a pose, the most fundamental obstacle first; a regularity of NaN counts as singular."""
    solvable = where(regularity > SINGULAR, int(Status.OK), int(Status.SINGULAR))
    return where(reached, solvable, int(Status.OUT_OF_REACH))
