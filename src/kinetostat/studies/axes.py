"""The axes of grids: ranges as written, and the parameters that they are about. Nothing is evaluated."""

from collections.abc import Sequence

from kinetostat.engine.points import Axis, Grid
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import Parameter, find
from kinetostat.spec.errors import InputError, several
from kinetostat.spec.ranges import Range, parse_range

MOST_DIMENSIONS = 6


def chosen_axes(machine: Machine, ranges: Sequence[str]) -> list[tuple[Range, Parameter]]:
    """Read the axes of a grid: ranges as written, and the parameters that they are about.

    Raises:
        InputError: an unknown field, a bad range, a field twice, or more than six dimensions.
    """
    ranges = several(ranges)
    if len(ranges) > MOST_DIMENSIONS:
        raise InputError(
            f"the grid has {len(ranges)} dimensions; at most {MOST_DIMENSIONS} are allowed: "
            "give the others one value each with --set."
        )
    wanted = [parse_range(text) for text in ranges]
    chosen = [find(machine.family, span.field) for span in wanted]
    taken = [leaf for parameter in chosen for leaf in parameter.leaves]
    for leaf in taken:
        if taken.count(leaf) > 1:
            raise InputError(f"{leaf} is varied twice; give each field one range.")
    return list(zip(wanted, chosen, strict=True))


def grid_of(axes: Sequence[tuple[Range, Parameter]]) -> Grid:
    """The points of a grid with these axes."""
    return Grid([Axis(parameter.leaves, span.values(parameter.quantity)) for span, parameter in axes])
