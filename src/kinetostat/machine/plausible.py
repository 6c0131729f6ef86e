"""Numbers of a machine that are hardly what was meant, as a bare number that was thought of in another unit.

They are pointed out, not refused: nothing is wrong with them but their size.
"""

import math
from collections.abc import Iterator

from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values

FULL_TURN = 2.0 * math.pi
BEYOND = 100.0
"""How many times the longest of all other lengths a length may be."""
SOFTEST = 100.0
"""N/m: what gives 10 mm under 1 N is no drive and no link of a machine."""


def doubts(machine: Machine) -> Iterator[str]:
    """A sentence for each implausible number: an angle beyond a turn, one length beyond all, no stiffness."""
    found = list(_numbers(machine))
    for path, field, kind, value in found:
        if kind == "angle" and abs(value) > FULL_TURN * (1.0 + 1e-9):
            yield f'{path} is {value:g} rad, more than a turn; if degrees are meant, write "{value:g} deg".'
        others = [abs(v) for _, other, k, v in found if k == kind == "length" and other != field]
        if 0.0 < BEYOND * max(others, default=0.0) < abs(value):
            yield f'{path} is {value:g} m, over {BEYOND:g} times all others; if mm are meant, write "{value:g} mm".'
        if kind == "linear stiffness" and 0.0 < value < SOFTEST:
            yield f'{path} is {value:g} N/m, next to nothing; if N/um are meant, write "{value:g} N/um".'


def _numbers(machine: Machine) -> Iterator[tuple[str, str, str, float]]:
    """Path, field, kind and value of every finite number; once for all entries of a field that are alike."""
    held = values(machine)
    fields = {p.path: p for p in parameters(machine.family)}
    entries = {leaf for p in fields.values() if p.quantity.count for leaf in p.leaves}
    for field in (p for p in fields.values() if p.path not in entries):
        own = {leaf: float(held[leaf]) for leaf in field.leaves if math.isfinite(held[leaf])}
        alike = {field.path: next(iter(own.values()))} if len(set(own.values())) == 1 else own
        yield from ((path, field.path, field.quantity.kind, value) for path, value in alike.items())
