"""SI numbers in the units people read: prefixes for axes and colour bars, degrees for angles. Computes nothing else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kinetostat.kinetostatics.quantities import GROUPS

PREFIXES = {1e-9: "n", 1e-6: "µ", 1e-3: "m", 1.0: "", 1e3: "k", 1e6: "M", 1e9: "G"}
"""By factor."""


@dataclass(frozen=True)
class Scale:
    """How to show values of one unit: multiply by `factor`, write `unit`."""

    factor: float
    unit: str

    def label(self, what: str) -> str:
        """An axis label: what it is and its unit."""
        return f"{what} ({self.unit})" if self.unit != "1" else what


def family_of_names(names: Sequence[str]) -> str:
    """The group of which all quantities are, such as "stiffness" where all are entries of K; else nothing."""
    return next((group for group in GROUPS if all(name.startswith(f"{group}_") for name in names)), "")


def spoken(name: str) -> str:
    """The name of a quantity as people say it."""
    return name.replace("_", " ")


def coordinate_scale(kind: str, unit: str, values: npt.NDArray[np.float64]) -> Scale:
    """For a coordinate: degrees for angles, millimetres for lengths under a metre, SI otherwise."""
    if kind == "angle":
        return Scale(180.0 / math.pi, "deg")
    if kind == "length" and np.abs(values).max() < 1.0:
        return Scale(1e3, "mm")
    return Scale(1.0, unit)


def prefixed_scale(unit: str, values: npt.NDArray[np.float64]) -> Scale:
    """For results: the SI prefix that brings the largest finite value between 1 and 1000."""
    finite = np.abs(values[np.isfinite(values)])
    if unit == "1" or finite.size == 0 or finite.max() == 0.0:
        return Scale(1.0, unit)
    power = 3 * math.floor(math.log10(finite.max() * (1.0 + 1e-12)) / 3)
    factor = min(max(10.0**power, min(PREFIXES)), max(PREFIXES))
    nearest = min(PREFIXES, key=lambda known: abs(math.log10(known / factor)))
    return Scale(1.0 / nearest, PREFIXES[nearest] + unit)
