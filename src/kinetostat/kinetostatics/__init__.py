"""Leg to (W, G), assembly to K and C, attribution, indices: one pose at a time."""
