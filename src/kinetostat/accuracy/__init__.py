"""The machine as built: small errors of its numbers, and how the tool moves by them (see `model`)."""
