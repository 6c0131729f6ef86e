"""Numerical tolerances of the whole package, named by what they mean.

No sizes, counts or limits of display live here, only numbers that decide when two floating-point results count as the
same, when something counts as zero, and when an iteration has converged. Each says why it has its value.
"""
