"""Three R-U-S legs, their cranks actuated, and the central ram P-U of `passive_leg_3dof_pu`.

Cranks and rods are ours (theory section 4).
"""

from kinetostat.machine.between_rings import with_cranks
from kinetostat.machine.catalogue.passive_leg_3dof_pu import RAM, SECTIONS, placed

FAMILY = with_cranks(
    "passive-leg-3dof-pu-rus",
    "3 R-U-S legs and a passive P-U ram; freedoms z, theta1, theta2",
    SECTIONS,
    placed,
    (RAM,),
)
