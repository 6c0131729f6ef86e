"""How the materials of a scene look, for every renderer and every format. Knows no solid and no light."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Look:
    """A surface as physically based renderers describe it.

    Attributes:
        color: of diffuse reflection, of a metal of its mirror images as well; sRGB as "#rrggbb".
        metalness: 0 for plastics and paint, 1 for a bare metal.
        roughness: 0 for a mirror, 1 for chalk.
        opacity: 1 unless one sees through it.
    """

    color: str
    metalness: float
    roughness: float
    opacity: float = 1.0


LOOKS = {
    "base": Look("#8b929c", 0.15, 0.6),
    "platform": Look("#c3c9d1", 0.3, 0.42),
    "actuated": Look("#1f6fb4", 0.2, 0.38),
    "passive": Look("#d9721f", 0.15, 0.42),
    "removed": Look("#9aa3ad", 0.0, 0.8, 0.25),
    "steel": Look("#d3d8de", 0.85, 0.24),
    "joint": Look("#4a525d", 0.55, 0.42),
    "motor": Look("#2b3440", 0.35, 0.5),
    "tool": Look("#b9a76a", 0.8, 0.3),
    "spring": Look("#17a673", 0.3, 0.35),
    "load": Look("#c81e4a", 0.0, 0.5),
    "ghost": Look("#d01f50", 0.0, 0.9, 0.4),
    "translation": Look("#2f9fe0", 0.0, 0.35, 0.38),
    "rotation": Look("#a855c7", 0.1, 0.4),
    "soft translation": Look("#0b7fc7", 0.1, 0.4),
    "soft rotation": Look("#8a2fb0", 0.1, 0.4),
    "x axis": Look("#d23b3b", 0.0, 0.5),
    "y axis": Look("#2c9c4a", 0.0, 0.5),
    "z axis": Look("#2d62d3", 0.0, 0.5),
}
"""What solids may be of, and how it looks."""


def looks_data() -> dict[str, dict[str, Any]]:
    """All looks as plain data, by the name of the material."""
    return {name: asdict(look) for name, look in LOOKS.items()}


def linear(color: str) -> tuple[float, float, float]:
    """Red, green and blue of "#rrggbb" as shares of light (IEC 61966-2-1)."""
    parts = [int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return red, green, blue
