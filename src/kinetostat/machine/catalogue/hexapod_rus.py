"""Hexapods with cranks: six R-U-S legs, the revolutes actuated, between two rings of joints; six freedoms."""

from typing import Annotated

from kinetostat.machine.catalogue import hexapod
from kinetostat.machine.catalogue.hexapod import LEGS, Pose, Six, placed
from kinetostat.machine.crank import CRANK_LINKS, CrankLinks, Cranks, crank_legs, outward
from kinetostat.machine.leg import RIGID
from kinetostat.machine.machine import Configuration, Family
from kinetostat.spec.fields import Quantity, section


@section
class Geometry(hexapod.Geometry, Cranks):
    """Table [geometry]; the cranks turn in vertical planes, outward where the platform is above the base."""

    crank_turn: Annotated[
        Six, Quantity("angle", "turn of each crank's plane about z, from the radial direction", count=LEGS)
    ] = (0.0,) * 6


@section
class Stiffness(hexapod.Stiffness):
    """Table [stiffness]."""

    actuator: Annotated[Six, Quantity("torsional stiffness", "stiffness of the actuated revolutes", count=LEGS)]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the rods, EA")] = RIGID
    crank_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the cranks, EI")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form; NaN where a rod does not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    platform, joints = placed(geometry, pose)
    sides = outward(joints[0], geometry.base_radius, geometry.crank_turn)
    links = CrankLinks(geometry.crank_length, geometry.rod_length, stiffness.crank_bending, stiffness.leg_axial)
    legs, limits = crank_legs(joints, sides, stiffness.actuator, links)
    return Configuration(platform, tuple(legs), tuple(limits), geometry.size)


FAMILY = Family(
    name="hexapod-rus",
    summary="6 R-U-S legs with actuated cranks; freedoms x, y, z, roll, pitch, yaw",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
    links=CRANK_LINKS,
)
