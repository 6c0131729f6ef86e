"""The reference numbers (`reference.json`, 12 digits, computed independently) and the designs they are for."""

import json
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.kinetostatics.assembly import stiffness_coefficients
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.loading import load
from kinetostat.machine.machine import springs
from numeric import array

FILE = Path(__file__).with_name("reference.json")
COMPONENTS = ("rx", "ry", "rz", "x", "y", "z")
OPTIMISED = (14, 26, 70, 55, 66, 35, 55)
"""The paper's own optimum, section 4.3."""
COMPUTED = 1e-9
"""Relative: the file has 12 digits, and the least of the diagonal entries loses three of ours to cancellation."""


@cache
def reference() -> dict[str, Any]:
    """The numbers for the 4-dof machine, as floats."""
    found = json.loads(FILE.read_text(encoding="utf-8"))
    assert tuple(found["order"]) == COMPONENTS
    return found["zhang_gosselin_4dof"]


@cache
def printed() -> dict[str, Any]:
    """What the paper prints, as decimal text, so that the last printed digit is known."""
    found = json.loads(FILE.read_text(encoding="utf-8"), parse_float=Decimal, parse_int=Decimal)
    return found["zhang_gosselin_4dof"]["paper_printed"]


def last_digit(number: Decimal) -> float:
    """The value of one unit in the last printed digit; the paper prints no trailing zeros."""
    return float(Decimal(1).scaleb(int(number.normalize().as_tuple().exponent)))


def rounds_to(value: float, number: Decimal) -> bool:
    """Whether `value` rounds to the printed number; a printed 0.0 stands for exactly zero."""
    if number == 0:
        return value == 0.0
    return abs(value - float(number)) <= 0.5 * last_digit(number) * (1 + 1e-9)


def at(*settings: str) -> Response:
    """The paper's machine with some of its fields replaced, at its pose."""
    return respond(load("zhang-gosselin-4dof", settings))


def with_passive(stiffness: str) -> Response:
    """At the reference design and pose, with k52 = k54 as in Tables III and IV."""
    return at(f"stiffness.passive_links={stiffness}")


def design(*numbers: float, passive: str) -> Response:
    """At s = [Rp, Rb, l51, l52, z (cm), Ta, Tb (deg)] of eq. 41."""
    names = ("platform_radius", "base_radius", "passive_links.0", "passive_links.1")
    lengths = [f"geometry.{name}={value} cm" for name, value in zip(names, numbers[:4], strict=True)]
    angles = [f"geometry.base_angle={numbers[5]} deg", f"geometry.platform_angle={numbers[6]} deg"]
    return at(*lengths, *angles, f"pose.z={numbers[4]} cm", f"stiffness.passive_links={passive}")


def coefficients(response: Response) -> Array:
    """Factors of Ka, k52 and k54 in the diagonal of K, from the attribution [6 x 3]."""
    parts = np.array([np.diag(array(part)) for part in stiffness_coefficients(response.statics)])
    names = [spring.name for spring in springs(response.configuration)]
    actuators = sum(parts[e] for e, name in enumerate(names) if "actuator" in name)
    return np.column_stack([actuators, parts[names.index("passive link 1")], parts[names.index("passive link 2")]])
