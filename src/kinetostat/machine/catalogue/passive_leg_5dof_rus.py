"""Five R-U-S legs, their cranks actuated, and the passive leg U-R-U of `passive_leg_5dof`.

Cranks and rods are ours (theory section 4).
"""

from typing import Annotated

from kinetostat.machine.catalogue import passive_leg_5dof
from kinetostat.machine.catalogue.passive_leg_5dof import LEGS, Five, Pose, guide
from kinetostat.machine.crank import CRANK_LINKS, CrankLinks, Cranks, crank_legs, outward
from kinetostat.machine.leg import RIGID
from kinetostat.machine.machine import Configuration, Family
from kinetostat.machine.rings import ends
from kinetostat.spec.fields import Quantity, section


@section
class Geometry(passive_leg_5dof.Geometry, Cranks):
    """Table [geometry]; the cranks turn in vertical planes, outward where the platform is above the base."""

    crank_turn: Annotated[
        Five, Quantity("angle", "turn of each crank's plane about z, from the radial direction", count=LEGS)
    ] = (0.0,) * 5


@section
class Stiffness(passive_leg_5dof.Stiffness):
    """Table [stiffness]."""

    actuator: Annotated[Five, Quantity("torsional stiffness", "stiffness of the actuated revolutes", count=LEGS)]
    leg_axial: Annotated[float, Quantity("axial rigidity", "axial rigidity of the rods, EA")] = RIGID
    crank_bending: Annotated[float, Quantity("bending rigidity", "bending rigidity of the cranks, EI")] = RIGID


def configure(geometry: Geometry, stiffness: Stiffness, pose: Pose) -> Configuration:
    """The machine at a pose, in closed form; NaN where the passive leg or a rod does not reach.

    Args:
        geometry, stiffness, pose: SI; base frame.
    """
    passive = guide(geometry, stiffness, pose)
    joined = ends(geometry, geometry.base_angles, geometry.platform_angles, passive.platform)
    sides = outward(joined[0], geometry.base_radius, geometry.crank_turn)
    links = CrankLinks(geometry.crank_length, geometry.rod_length, stiffness.crank_bending, stiffness.leg_axial)
    legs, limits = crank_legs(joined, sides, stiffness.actuator, links)
    return passive.moved_by(legs, geometry.size, limits)


FAMILY = Family(
    name="passive-leg-5dof-rus",
    summary="5 R-U-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
    sections={"geometry": Geometry, "stiffness": Stiffness, "pose": Pose},
    configure=configure,
    links=(*CRANK_LINKS, passive_leg_5dof.PASSIVE_LINKS),
)
