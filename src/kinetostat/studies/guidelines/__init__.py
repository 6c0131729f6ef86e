"""Guidelines of a design: what each direction depends on, which way to move what, in sentences."""
