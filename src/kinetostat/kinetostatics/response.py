"""From a machine at a pose to K, C and a status: the whole derivation in one function.

It holds for floats (one pose), for columns of numbers (many) and, traced by the engine, for millions of poses. Where
the status is not OK, results are meaningless; the engine and the studies mask them.

Source: theory sections 2 to 9, in their order; loads of actuators, theory (29).
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from kinetostat.algebra.scalar import Scalar, is_zero, smaller, where
from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import Vector
from kinetostat.frozen import dataclass
from kinetostat.kinematics.closing import Joints, within_reach
from kinetostat.kinematics.limits import Check, geometric_checks, load_checks, within
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, solve_statics, stiffness_matrix
from kinetostat.kinetostatics.drive_limits import DriveLimits, drive_limits
from kinetostat.kinetostatics.feasible import Face, Transmission, acceleration_faces, transmission, wrench_faces
from kinetostat.late import LateModule
from kinetostat.machine.leg import Joint, Spring
from kinetostat.machine.leg_screws import LegScrews, reciprocal_wrenches
from kinetostat.machine.limits import limits_loads
from kinetostat.machine.loads import load_on_platform, moving_mass
from kinetostat.machine.machine import Configuration, Machine, springs
from kinetostat.spec.renamed import renamed_property
from kinetostat.tolerances import SINGULAR

if TYPE_CHECKING:
    from kinetostat.kinematics import closure
else:
    closure = LateModule("kinetostat.kinematics.closure")


@dataclass(frozen=True)
class Response:
    """Everything that is computed of a machine at a pose.

    Attributes:
        configuration: the machine at the pose.
        reference: the tool point T (P itself unless the machine has a tool), in its plane if it has one, base frame, m.
        legs: screws of every leg at T, base axes.
        guide: wrenches of a planar machine against twists that do not exist there; at T, base axes.
        statics: how the springs share loads.
        stiffness, compliance: K (N·m/rad, N/rad, N/m) and C (rad/(N·m), rad/N, m/N) at T, base axes; of a planar
            machine only rz, x, y have a meaning, and the other entries are 0.
        singularity_margin: 0 at a singularity, at most 1 (dimensionless): the least of the legs' and the platform's
            (theory section 2).
        status: a `Status` code.
        load: all loads on the platform with its weight, at T, base axes (N·m, N).
        checks: the limits of the machine that are set, each with what it is compared with.
        mass: mass of what moves, as far as it is known, kg.
        joint_status: `Status` code of the joints alone, before the pose is judged.
        place_status: as `status`, but a singular pose within the limits of geometry is OK, and one beyond them
            JOINT_LIMIT: loads can hold a machine there.
        frequencies: the lowest natural frequencies, Hz, where they have been computed.
        cutting_pressure: cutting pressure in the machine's table [cutting], N/m².
        meant_loaded: whether the machine is meant at rest under its loads (`Machine.loaded`): its actuators then carry
            what they carry there, and limits of their loads are judged there.
        softest: the least real part of the receptance across the cut, m/N, where it has been computed.
        loaded: numbers of the loaded state (`equilibrium.numbers`), where they have been computed.
        cables: numbers of cables (`equilibrium.cables`), where they have been computed.
        drives: what each drive may do, in the order of the actuators that hold something.
        acceleration_loads: load of each drive per unit of acceleration at the tool point (`motion.machine_at_pose`),
            where it has been computed.
        lost_motion_of_joints: motion of the tool that friction of passive joints holds back, by component, m or rad
            (`motion.response`), where it has been computed.
    """

    configuration: Configuration
    reference: Vector
    legs: tuple[LegScrews, ...]
    guide: tuple[Wrench, ...]
    statics: Statics
    stiffness: Symmetric6
    compliance: Symmetric6
    singularity_margin: Scalar
    status: Scalar
    load: Wrench
    checks: tuple[Check, ...] = ()
    mass: Scalar = 0.0
    joint_status: Scalar = int(Status.OK)
    place_status: Scalar = int(Status.OK)
    loaded: Mapping[str, Any] | None = None
    meant_loaded: bool = False
    frequencies: Sequence[Scalar] | None = None
    cutting_pressure: Scalar = 0.0
    softest: Scalar | None = None
    cables: Mapping[str, Any] | None = None
    drives: tuple[DriveLimits, ...] = ()
    acceleration_loads: Sequence[Twist] | None = None
    lost_motion_of_joints: Sequence[Scalar] | None = None
    regularity = renamed_property("singularity_margin")

    @cached_property
    def transmission(self) -> Transmission:
        """The way in which drives and platform act on each other, as rigid bodies."""
        return transmission(self.configuration, self.legs, self.guide)

    @cached_property
    def drive_loads(self) -> list[Scalar]:
        """Load of each drive by the loads that count already, N or N·m.

        Of a machine that is meant under its loads, it is what it carries at rest; NaN where that is not known.
        """
        if self.meant_loaded:
            return list((self.loaded or {}).get("drive_loads", [math.nan] * len(self.drives)))
        return [self.load.work(share) for share in self.transmission.shares]

    @cached_property
    def faces(self) -> list[Face]:
        """The wrenches that the drives hold beside the loads that count already, theory (82)."""
        return wrench_faces(self.transmission, self._bounds, self.drive_loads)

    @cached_property
    def acceleration_faces(self) -> list[Face]:
        """The accelerations from rest that the drives allow beside the loads that count already; none if not known."""
        rows = self.acceleration_loads
        if rows is None:
            return []
        return acceleration_faces(self.transmission, rows, self._bounds, self.drive_loads)

    @property
    def _bounds(self) -> list[tuple[Scalar, Scalar]]:
        return [(drive.lower, drive.upper) for drive in self.drives]

    @property
    def undecided(self) -> bool:
        """Whether it is undecided, at a single pose that is not singular, which rigid parts share a load."""
        return bool(self.statics.doubt > 0.5 and self.singularity_margin > SINGULAR)


def respond(machine: Machine, joints: Joints | None = None, configuration: Configuration | None = None) -> Response:
    """Compute K, C and the status of a machine at its pose.

    Args:
        machine: the machine with its pose.
        joints: its joint coordinates, if they are known; otherwise they are found where the family has no closed form.
        configuration: the machine placed with them, if it has been.
    """
    if joints is None:
        joints = closure.solve_joints(machine) if machine.family.chains else CLOSED_FORM
    configuration = configuration or machine.configure(joints.coordinates)
    reference, guide, legs, statics = _statics(machine, configuration)
    singularity_margin: Scalar = 1.0
    for leg in legs:
        singularity_margin = smaller(singularity_margin, leg.singularity_margin)
    singularity_margin = smaller(singularity_margin, statics.singularity_margin)
    geometric = geometric_checks(machine, configuration, joints.coordinates)
    loaded = actuator_checks(machine, configuration, statics)
    reached, allowed, borne = within_reach(configuration), within(geometric), within(loaded)
    undetermined = abs(joints.status - float(Status.SINGULAR)) < 0.5
    return Response(
        configuration=configuration,
        reference=reference,
        legs=legs,
        guide=guide,
        statics=statics,
        stiffness=stiffness_matrix(statics),
        compliance=compliance_matrix(statics),
        singularity_margin=singularity_margin,
        status=pose_status(joints.status, reached, singularity_margin, allowed, borne, statics.doubt),
        load=load_on_platform(machine, configuration.platform),
        checks=(*geometric, *loaded),
        mass=moving_mass(machine, configuration),
        joint_status=joints.status,
        place_status=pose_status(
            where(undetermined, int(Status.OK), joints.status),
            reached,
            singularity_margin if loaded else 1.0,
            allowed,
            borne,
            statics.doubt if loaded else 0.0,
            singular=where(allowed, int(Status.OK), int(Status.JOINT_LIMIT)),
        ),
        meant_loaded=machine.loaded,
        drives=drive_limits(machine, configuration),
    )


def compliance_at(machine: Machine, configuration: Configuration) -> Symmetric6:
    """C of a machine whose legs are where a configuration says, at its tool point, base axes (rad, m per N·m, N).

    Args:
        machine: the machine whose tool counts.
        configuration: the place of its legs, which need not follow from its own numbers.
    """
    *_, statics = _statics(machine, configuration)
    return compliance_matrix(statics)


def _statics(
    machine: Machine, configuration: Configuration
) -> tuple[Vector, tuple[Wrench, ...], tuple[LegScrews, ...], Statics]:
    """The tool point, the guide of a planar machine, the screws of all legs, and how springs share loads."""
    reference, length = machine.reference_point(configuration), configuration.length
    absent, guide = _out_of_plane(configuration, reference)
    legs = tuple(leg.screws(reference, length, absent) for leg in configuration.legs)
    return reference, guide, legs, solve_statics(legs, length, guide)


CLOSED_FORM = Joints((), int(Status.OK))
"""The joints of a machine whose family places them itself."""


def _out_of_plane(configuration: Configuration, reference: Vector) -> tuple[tuple[Joint, ...], tuple[Wrench, ...]]:
    """Freedoms that a planar machine does not have, and the wrenches against them."""
    if configuration.plane is None:
        return (), ()
    freedoms = [joint.twist(reference) for joint in configuration.plane.freedoms]
    wrenches, _ = reciprocal_wrenches(freedoms, configuration.length)
    return configuration.plane.missing_freedoms, wrenches


def pose_status(
    placed: Scalar,
    reached: Scalar,
    singularity_margin: Scalar,
    allowed: Scalar = True,
    borne: Scalar = True,
    doubt: Scalar = 0.0,
    singular: Scalar = int(Status.SINGULAR),
) -> Scalar:
    """Status code of a pose, the most fundamental obstacle first; a singularity margin of NaN counts as singular.

    Limits come last: a pose beyond them is called singular or undecided if it is, for no change of limits gives it K
    and C.

    Args:
        placed: `Status` code of the joints.
        reached: whether all legs close.
        singularity_margin: singularity margin of the pose.
        allowed: whether the limits of geometry are kept.
        borne: whether the actuators bear the load, which means something where the pose is regular.
        doubt: 1 where it is undecided which rigid parts share a load, else 0.
        singular: status code of a singular pose.
    """
    kept = where(allowed, where(borne, int(Status.OK), int(Status.JOINT_LIMIT)), int(Status.JOINT_LIMIT))
    decided = where(doubt > 0.5, int(Status.UNDECIDED), kept)
    solvable = where(singularity_margin > SINGULAR, decided, singular)
    return where(placed > Status.OK + 0.5, placed, where(reached, solvable, int(Status.OUT_OF_REACH)))


def actuator_loads(configuration: Configuration, statics: Statics, load: Wrench) -> list[tuple[Spring, Scalar]]:
    """Return every actuator with the size of its force (N) or moment (N·m): |xi_e . w|.

    Actuators that are free by form carry nothing and are left out.

    Args:
        configuration, statics: a machine at its pose, and its statics there.
        load: the wrench at the tool point, base axes.
    """
    pairs = zip(springs(configuration), statics.flexibility, strict=True)
    driven = [(spring, twist) for spring, twist in pairs if spring.actuated and not is_zero(spring.stiffness)]
    return [(spring, abs(load.work(twist))) for spring, twist in driven]


def actuator_checks(machine: Machine, configuration: Configuration, statics: Statics) -> list[Check]:
    """Compare the loads of the actuators with their limits; nothing to compare without a load or a limit.

    A machine that is meant under its loads is judged where it is at rest (`equilibrium.numbers`), not here.

    Args:
        machine: the machine with [limits] and [load].
        configuration, statics: the machine at its pose, and its statics there.
    """
    if machine.loaded or not limits_loads(machine.tables["limits"]):
        return []
    load = load_on_platform(machine, configuration.platform)
    if all(is_zero(component) for component in load.components()):
        return []
    return load_checks(machine, configuration, actuator_loads(configuration, statics, load))
