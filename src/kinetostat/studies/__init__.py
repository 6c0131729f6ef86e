"""A question and its answer, as labelled and saved data."""
