"""Vectors, rotations, screws, symmetric 6x6, small dense solves, over any scalar. Knows no machine."""
