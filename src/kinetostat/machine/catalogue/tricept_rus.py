"""Three R-U-S legs, their cranks actuated, and the central tube U-P of the `tricept`.

Cranks and rods are ours (theory section 4).
"""

from kinetostat.machine.between_rings import with_cranks
from kinetostat.machine.catalogue.tricept import SECTIONS, TUBE, placed

FAMILY = with_cranks(
    "tricept-rus", "3 R-U-S legs and a passive U-P tube; freedoms theta1, theta2, length", SECTIONS, placed, (TUBE,)
)
