"""Quantities over a grid of parameters: in memory, or in a file that is written while it is computed."""
