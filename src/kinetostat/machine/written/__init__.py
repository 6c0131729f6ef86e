"""Machines written leg by leg: their file, their tables and how joint coordinates place them."""
