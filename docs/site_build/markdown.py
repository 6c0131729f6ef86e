"""Tables and numbers as Markdown."""

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: int = 0) -> str:
    """A table; so many of its last columns are numbers, set to the right."""
    rules = ["---"] * (len(head) - numbers) + ["---:"] * numbers
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rules, *rows)) + "\n"


def difference(value: float, allowed: float) -> str:
    """A relative difference, to one digit: more of it is chance.

    Raises:
        ValueError: it is larger than what is allowed, which no page may show as if nothing were wrong.
    """
    if not value <= allowed:
        raise ValueError(f"a difference of {value:.3g}, where {allowed:g} is allowed")
    return "0" if value == 0.0 else f"{value:.0e}"
