"""The scalars of a response that maps, sweeps and tables may ask for, by name, with unit and label."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from kinetostat.algebra.scalar import Scalar
from kinetostat.algebra.screw import COMPONENTS
from kinetostat.algebra.symmetric import POSITIONS
from kinetostat.kinetostatics.response import Response
from kinetostat.kinetostatics.sides import side

ROTATIONS = 3
"""How many of the six components are rotations; they come first."""


@dataclass(frozen=True)
class MapQuantity:
    """One scalar at one pose.

    Attributes:
        name: as in files and on the command line.
        unit: SI, for people.
        symbol: for axis labels (matplotlib mathematics).
        value: from a response.
    """

    name: str
    unit: str
    symbol: str
    value: Callable[[Response], Scalar]


def _compliance(response: Response, i: int, j: int) -> Scalar:
    return response.compliance.entry(i, j)


def _stiffness(response: Response, i: int, j: int) -> Scalar:
    return response.stiffness.entry(i, j)


def _regularity(response: Response) -> Scalar:
    return response.regularity


def _mass(response: Response) -> Scalar:
    return response.mass


def _compliance_unit(i: int, j: int) -> str:
    rows = "rad" if i < ROTATIONS else "m"
    return f"{rows}/(N·m)" if j < ROTATIONS else f"{rows}/N"


def _stiffness_unit(i: int, j: int) -> str:
    if j < ROTATIONS:
        return "N·m/rad"
    return "N/rad" if i < ROTATIONS else "N/m"


def _entries(
    matrix: str, letter: str, unit: Callable[[int, int], str], value: Callable[..., Scalar]
) -> list[MapQuantity]:
    found = []
    for i, j in POSITIONS:
        names = [COMPONENTS[i]] if i == j else [COMPONENTS[i], COMPONENTS[j]]
        symbol = rf"${letter}_{{\mathrm{{{','.join(names)}}}}}$"
        found.append(MapQuantity("_".join([matrix, *names]), unit(i, j), symbol, partial(value, i=i, j=j)))
    return found


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        *_entries("compliance", "C", _compliance_unit, _compliance),
        *_entries("stiffness", "K", _stiffness_unit, _stiffness),
        MapQuantity("regularity", "1", "regularity", _regularity),
        MapQuantity("mass", "kg", "moving mass", _mass),
        MapQuantity("side", "1", "side of singularities", side),
    )
}
"""Every quantity by name: compliance_rx, compliance_rx_z, ..., stiffness_x, ..., regularity, mass, side."""

GROUPS = {
    "compliance": tuple(f"compliance_{name}" for name in COMPONENTS),
    "stiffness": tuple(f"stiffness_{name}" for name in COMPONENTS),
}
"""Names that stand for several quantities: the six diagonal entries of C and of K."""
