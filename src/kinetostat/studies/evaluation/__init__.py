"""Quantities of a machine at poses of the user's own: a table of numbers in Python, or a file."""
