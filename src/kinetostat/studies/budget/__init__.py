"""The error of the tool that tolerances allow, what it is made of, and which tolerances cost least."""
