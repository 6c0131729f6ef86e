"""The section on the machine as built, where the record of a fit is given. Nothing is computed here."""

from collections.abc import Iterator

from kinetostat.display import DASH, Scale, number
from kinetostat.machine.machine import Machine
from kinetostat.studies.identification.record import FitRecord
from kinetostat.views.identification_tables import NOT_EXPLAINED, scale_of, value_and_half
from kinetostat.views.report.content import Block, Figure, Paragraph, Section, Table
from kinetostat.views.report.typesetting import typeset

STAGES = ("as drawn", "as identified", "of poses left out")
KINDS = {"length": ("positions and distances", "m"), "angle": ("angles", "rad")}
CAPTIONS = {
    "residuals": "What is left of every measured value, as drawn and as identified.",
    "correlations": "Correlations of the numbers: which ones were found together.",
    "poses": "The tool points at which was measured, from above and from the front.",
}
MOST_OUTLIERS = 40


def identification_section(record: FitRecord, machine: Machine) -> Section:
    """Write the section: how well measurements are explained, by which numbers, and what they do not see.

    Args:
        record: of the fit.
        machine: as drawn, in whose units the numbers are.
    """
    return Section("Identification", tuple(_blocks(record, machine)))


def _blocks(record: FitRecord, machine: Machine) -> Iterator[Block]:
    yield Paragraph(typeset(_verdict(record)), "As measured:")
    rows = [
        (name, *(_shown(size.get(kind), machine.display.deflection(unit)) for size in record.residuals))
        for kind, (name, unit) in KINDS.items()
        if any(kind in size for size in record.residuals)
    ]
    if rows:
        yield _table("Residuals, root mean square.", ("", *STAGES), rows)
    yield from _pictures(record, "residuals")
    numbers = [
        (u.path, *map(typeset, value_and_half(u.value, u.half, scale)), scale.unit, u.words)
        for u, scale in ((u, scale_of(machine, u.unit, u.group)) for u in record.unknowns)
    ]
    caption = "Identified numbers, with half of their 95 % intervals."
    heads = ("error", "value", "±", "unit", "meaning")
    yield Table(caption, heads, tuple(numbers), (False, True, True, False, False))
    yield from _pictures(record, "correlations", "poses")
    if record.unseen:
        scale = machine.display.deflection("m")
        unseen = [(words, _shown(tool, scale), _shown(inside, scale)) for words, tool, inside in record.unseen]
        columns = ("combination", "moves the tool by", "of that, inside the machine")
        yield Table("What no measured pose sees.", columns, tuple(unseen), (False, True, True))
    if record.outliers:
        ordered = sorted(record.outliers, key=lambda outlier: -abs(outlier[2]))
        caption = f"Values that were set aside, {len(ordered)} in all, those that are farthest off first."
        aside = [(str(line), name, number(off, digits=3)) for line, name, off in ordered[:MOST_OUTLIERS]]
        yield Table(caption, ("line", "value", "standard deviations"), tuple(aside), (False, False, True))


def _verdict(record: FitRecord) -> str:
    hidden = len(record.unknowns) - record.rank
    text = (
        f"{len(record.unknowns)} numbers were identified from {record.values} values at {record.poses} poses "
        f"({record.data}). {record.rank} combinations of them are seen{f', {hidden} are not' if hidden else ''}; "
        f"{len(record.outliers)} values were set aside as outliers."
    )
    if record.known and record.scatter > NOT_EXPLAINED:
        return (
            f"{text} The residuals are {number(record.scatter, digits=2)} times as large as the standard deviations "
            "say: the measurements are less sure, or something that moves the tool was not fitted."
        )
    return text


def _pictures(record: FitRecord, *names: str) -> Iterator[Figure]:
    for name in names:
        if name in record.pictures:
            yield Figure(CAPTIONS[name], record.pictures[name], 0.85)


def _table(caption: str, heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> Table:
    return Table(caption, heads, tuple(rows), (False, *[True] * (len(heads) - 1)))


def _shown(value: float | None, scale: Scale) -> str:
    return DASH if value is None else typeset(f"{number(value * scale.factor)} {scale.unit}")
