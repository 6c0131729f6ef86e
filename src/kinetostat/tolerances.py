"""Numerical tolerances of the whole package, named by what they mean.

No sizes, counts or limits of display live here, only numbers that decide when two floating-point results count as the
same, when something counts as zero, and when an iteration has converged. Each says why it has its value.
"""

# Limits of machines

LIMIT_SLACK = 1e-9
"""Share of its scale by which a measure may pass a limit that still counts as kept: so that a pose that was computed to
lie exactly at its limit is not refused by round-off, and yet far below what anyone can measure on a machine."""

# Exchange with other programs

ROUND_OFF_OF_COUPLING = 1e-14
"""Share of the root of two diagonal entries of K below which the entry that couples them is written as 0."""
COINCIDENT_HINGES = 1e-9
"""Distance, m, below which hinges of a chain lie at one point and become one joint or share a body."""
INDEPENDENT_AXES = 1e-6
"""Volume or area spanned by unit axes of a URDF below which one of them depends on the others."""
OPEN_LOOP = 1e-6
"""Gap, m, or angle, rad, of a URDF's loop above which it is open: files have about this many digits."""
EVEN_CHORDS = 1e-9
"""Relative difference of chords up to which they belong to one arc: far above round-off, far below what is visible."""
OPEN_CASCADE_POINT = 1e-7
"""Distance of points that Open CASCADE takes for one, mm (its own default precision)."""
SOFT_CONSTRAINT = 1e-6
"""Compliance of a MuJoCo constraint as a share of the machine's; a dozen constraints add up to about 1e-5."""
RIGID_BLOCK = 1e-9
"""Share of the other diagonal block of C below which a block counts as rigid."""
