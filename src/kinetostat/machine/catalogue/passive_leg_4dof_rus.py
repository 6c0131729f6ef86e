"""Four R-U-S legs, their cranks actuated, and the passive leg of `passive_leg_4dof` (Zhang and Gosselin).

Cranks and rods are ours (theory section 4).
"""

from kinetostat.machine.between_rings import with_cranks
from kinetostat.machine.catalogue.passive_leg_4dof import PASSIVE_LINKS, SECTIONS, placed

FAMILY = with_cranks(
    "passive-leg-4dof-rus",
    "4 R-U-S legs and a passive R-R-Hooke leg; freedoms x, z, theta5, theta6",
    SECTIONS,
    placed,
    (PASSIVE_LINKS,),
)
