"""Five R-U-S legs, their cranks actuated, and the passive leg U-R-U of `passive_leg_5dof`.

Cranks and rods are ours (theory section 4).
"""

from kinetostat.machine.between_rings import with_cranks
from kinetostat.machine.catalogue.passive_leg_4dof import PASSIVE_LINKS
from kinetostat.machine.catalogue.passive_leg_5dof import SECTIONS, placed

FAMILY = with_cranks(
    "passive-leg-5dof-rus",
    "5 R-U-S legs and a passive U-R-U leg; freedoms x, y, z, theta5, theta6",
    SECTIONS,
    placed,
    (PASSIVE_LINKS,),
)
