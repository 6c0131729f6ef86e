"""Pose to leg configurations: reach, singularity, status."""
