"""A workspace as tables on a terminal, with units."""

from collections.abc import Iterator

from rich.console import Console

from kinetostat.studies.workspace.verdicts import INSIDE, phrase
from kinetostat.studies.workspace.workspace import Workspace
from kinetostat.views.display import coordinate_scale
from kinetostat.views.tables import number, numeric_table

ERRORS = 2
"""Standard errors that are printed: the truth lies within them 95 times of 100."""


def print_workspace(console: Console, found: Workspace) -> None:
    """Volume, why the rest is outside, how far the inside extends, and what it asks of the machine."""
    for line in _summary(found):
        console.print(line, highlight=False)
    total = found.dataset["verdict"].size
    table = numeric_table(f"Nodes of the grid ({total:,})", "", ["nodes", "share"])
    for label, count in sorted(found.counts.items(), key=lambda item: (item[0] != INSIDE, -item[1])):
        if count:
            table.add_row(phrase(label), f"{count:,}", f"{100.0 * count / total:.3g} %")
    console.print(table)
    if found.extents:
        _print_extents(console, found)
    if found.demands:
        table = numeric_table("Demands on the machine within the workspace", "", ["from", "to", ""])
        for demand in found.demands:
            table.add_row(demand.title, number(demand.least), number(demand.greatest), demand.unit)
        console.print(table)


def _summary(found: Workspace) -> Iterator[str]:
    volume = found.volume
    name = "Area" if len(found.dataset["verdict"].dims) == 2 else "Volume"
    yield found.dataset.attrs["machine"]
    yield (
        f"{name}: {volume.value:.5g} ± {ERRORS * volume.standard_error:.2g} {volume.unit} "
        f"({100.0 * volume.share:.4g} % of the box; two random points in each of {volume.cells:,} cells, ± two "
        "standard errors)."
    )
    if not found.found:
        yield "No pose of the box is in the workspace; the table shows why."
    elif found.joined is None:
        yield "The pose of the file is outside the workspace, so it is unknown which part can be reached from it."
    elif found.joined < 1.0:
        yield f"Only {100.0 * found.joined:.3g} % of the workspace is connected with the pose of the file."
    if not found.divided:
        yield (
            "Singularities are not borders here: they do not divide the poses of this machine, or the pose of the file "
            "is singular."
        )


def _print_extents(console: Console, found: Workspace) -> None:
    table = numeric_table("Extent of the workspace", "", ["from", "to", ""])
    for dim, ends in found.extents.items():
        coordinate = found.dataset[dim]
        scale = coordinate_scale(coordinate.attrs["kind"], coordinate.attrs["units"], coordinate.values)
        low, high = (number(round(end * scale.factor, 9)) for end in ends)
        table.add_row(dim.removeprefix("pose."), low, high, scale.unit)
    console.print(table)
