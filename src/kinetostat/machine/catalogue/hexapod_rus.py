"""Hexapods with cranks: six R-U-S legs, the revolutes actuated, between two rings of joints; six freedoms."""

from kinetostat.machine.between_rings import with_cranks
from kinetostat.machine.catalogue.hexapod import SECTIONS, placed

FAMILY = with_cranks(
    "hexapod-rus", "6 R-U-S legs with actuated cranks; freedoms x, y, z, roll, pitch, yaw", SECTIONS, placed
)
