"""Identification: the numbers of a machine as built that explain what was measured, with their uncertainty."""
