"""Machines written leg by leg: their file, their sections and how joint coordinates place them."""
