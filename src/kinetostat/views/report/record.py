"""Sections about how the numbers came to be: the theory, and what is needed to have the report again."""

import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

from kinetostat.studies.paper.printed import CITATION
from kinetostat.views.report.content import Formula, Listing, Paragraph, Section, Table

LIBRARIES = ("kinetostat", "numpy", "scipy", "llvmlite", "pymoo", "matplotlib")


THEORY = (
    "Every elastic part is described by its compliance, which is 0 for a rigid one: rigid and flexible parts are one "
    "model, exact in the limit, and no large number stands in for infinity. Units are SI, in base axes; "
    "a twist is (rotation, translation), a wrench (moment, force), both at the reference point. K and C are those of "
    "small motions."
)
LEGS = (
    "A leg carries the wrenches W that do no work on its passive joints (unit twists J with index p) and yields by its "
    "elastic coordinates (unit twists J with index e, compliances S):"
)
SOURCE = f"Source: {CITATION}, and the documentation of kinetostat, theory."
AGAIN = (
    "The same command with the same input and the same versions gives this report again, byte for byte. The machine "
    "with all digits (machine.toml) and the results (results.json) are inside this file."
)


def method_section() -> Section:
    """The theory in two formulas."""
    return Section(
        "Method",
        (
            Paragraph(THEORY),
            Paragraph(LEGS),
            Formula("leg"),
            Paragraph("Legs add up; where springs are rigid or the machine is redundant, the force method takes over:"),
            Formula("assembly"),
            Paragraph(SOURCE),
        ),
    )


@dataclass(frozen=True)
class Origin:
    """What a report was made of.

    Attributes:
        command: that makes it again.
        inputs: name and text of each file, as written.
        machine_file: the machine with all overrides, all digits.
        results: the analysis as JSON.
    """

    command: str
    inputs: tuple[tuple[str, str], ...]
    machine_file: str
    results: str


def record_section(origin: Origin, engine: Sequence[str]) -> Section:
    """Versions, the command and the input."""
    versions = [(name, version(name)) for name in LIBRARIES] + [("Python", platform.python_version())]
    if engine:
        versions.append((engine[0], engine[1]))
    return Section(
        "Record",
        (
            Paragraph(AGAIN),
            Listing("Command.", origin.command),
            Table("Versions.", ("program", "version"), tuple(versions), (False, False)),
            *(Listing(f"Input: {name}.", text) for name, text in origin.inputs),
        ),
    )
