"""The factor by which a deflected shape is exaggerated: as a slider and as text. Knows no page."""

import math

from kinetostat.spec.errors import InputError, shorten

AUTO = "auto"
"""What leaves the choice of a factor to the page."""
DECADES = (-3, 9)
"""Powers of ten between which a factor lies."""
ROUND = (1.0, 2.0, 5.0)
STEPS = len(ROUND) * (DECADES[1] - DECADES[0])
"""Positions of the slider: 1, 2 and 5 times every power of ten."""


def factor_at(position: int) -> float:
    """The factor at a position from 0 to `STEPS`."""
    decades, step = divmod(min(max(position, 0), STEPS), len(ROUND))
    return float(f"{ROUND[step]:g}e{DECADES[0] + decades}")


def position_of(factor: float) -> int:
    """The position nearest to a factor, by their ratio."""
    return min(range(STEPS + 1), key=lambda position: abs(math.log(factor_at(position) / factor)))


def read_factor(text: str) -> float | None:
    """The factor that was typed; None for the page's own choice.

    Raises:
        InputError: it is not a number in range.
    """
    typed = text.strip().lstrip("×x").strip()
    if typed == AUTO or not typed or typed.endswith(f"({AUTO})"):
        return None
    least, most = (10.0**power for power in DECADES)
    try:
        factor = float(typed.replace(",", ""))
    except ValueError:
        factor = math.nan
    if not least <= factor <= most:
        raise InputError(
            f"the exaggeration is {shorten(text)}; it must be a number from {least:g} to {most:g}, or {AUTO}."
        )
    return factor


def factor_text(factor: float, own: bool) -> str:
    """A factor as people read it; `own` if the page chose it."""
    return f"{factor:,.6g}" + (f" ({AUTO})" if own else "")
