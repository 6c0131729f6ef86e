"""The machine and its results in the formats of other programs, and back."""
