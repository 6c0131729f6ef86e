"""Numerical tolerances of the whole package, named by what they mean.

No sizes, counts or limits of display live here, only numbers that decide when two floating-point results count as the
same, when something counts as zero, and when an iteration has converged. Each says why it has its value.
"""

# Limits of machines

LIMIT_SLACK = 1e-9
"""Share of its scale by which a measure may pass a limit that still counts as kept: so that a pose that was computed to
lie exactly at its limit is not refused by round-off, and yet far below what anyone can measure on a machine."""
