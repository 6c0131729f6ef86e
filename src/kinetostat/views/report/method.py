"""Sections on the method of a report and on how to repeat it: its theory, the command, the versions and the input."""

import platform
from collections.abc import Sequence
from importlib.metadata import version

from kinetostat.frozen import dataclass
from kinetostat.studies.printed_numbers import CITATION
from kinetostat.views.report.content import Formula, Listing, Paragraph, Section, Table

LIBRARIES = ("kinetostat", "numpy", "scipy", "llvmlite", "pymoo", "matplotlib")
"""Programs whose versions decide the digits and the pictures of a report."""
THEORY_TEXT = (
    "Every elastic part is described by its compliance, which is 0 for a rigid part: rigid and flexible parts are one "
    "model, exact in the limit, and no large number stands in for infinity. Units are SI, in base axes; a twist is "
    "(rotation, translation), a wrench (moment, force), both at the reference point. K and C hold for small motions."
)
LEGS_TEXT = (
    "A leg carries the wrenches W that do no work on its passive joints (unit twists J with index p). Under them it "
    "deflects by its elastic coordinates (unit twists J with index e, compliances S):"
)
SUM_TEXT = (
    "The stiffnesses of the legs add up; where springs are rigid or the machine is overconstrained, the force method "
    "is used instead:"
)
AGAIN_TEXT = (
    "The same command with the same input and the same versions makes this report again, byte for byte. The machine "
    "with all digits (machine.toml) and the results (results.json) are inside this file."
)


def _matrix(letter: str, below: str = "", above: str = "") -> str:
    """Write a bold letter with an index and a power, as MathML."""
    base = f'<mi mathvariant="normal" class="matrix">{letter}</mi>'
    if below and above:
        return f"<msubsup>{base}{below}{above}</msubsup>"
    return f"<msub>{base}{below}</msub>" if below else base


_LEG, _ELASTIC, _PASSIVE, _TRANSPOSED = (f"<mi>{letter}</mi>" for letter in ("i", "e", "p", "T"))
_INVERSE = "<mrow><mo>−</mo><mn>1</mn></mrow>"
_EQUALS, _AND = "<mo>=</mo>", '<mo>,</mo><mspace width="2em"/>'
_CARRIED = [_matrix("J", _PASSIVE, _TRANSPOSED), _matrix("W", _LEG), _EQUALS, "<mn>0</mn>"]
_DEFLECTING = [
    _matrix("G", _LEG), _EQUALS, _matrix("W", _LEG, _TRANSPOSED), _matrix("J", _ELASTIC), _matrix("S"),
    _matrix("J", _ELASTIC, _TRANSPOSED), _matrix("W", _LEG),
]  # fmt: skip

MOTION = Formula(
    "".join([
        _matrix("w"), _EQUALS, _matrix("K"), _matrix("t"), _AND, _matrix("t"), _EQUALS, _matrix("C"), _matrix("w"),
    ]),
    "bold(w) = bold(K) thin bold(t), quad quad bold(t) = bold(C) thin bold(w)",
)  # fmt: skip
"""Relation of a load and the small motion that it causes."""
LEG = Formula(
    "".join([*_CARRIED, _AND, *_DEFLECTING]),
    "bold(J)_p^T bold(W)_i = 0, quad quad bold(G)_i = bold(W)_i^T bold(J)_e bold(S) bold(J)_e^T bold(W)_i",
)
"""Wrenches that a leg carries, and its deflection."""
ASSEMBLY = Formula(
    "".join([
        _matrix("K"), _EQUALS, f"<munder><mo>∑</mo>{_LEG}</munder>", _matrix("W", _LEG), _matrix("G", _LEG, _INVERSE),
        _matrix("W", _LEG, _TRANSPOSED),
    ]),
    "bold(K) = sum_i bold(W)_i bold(G)_i^(-1) bold(W)_i^T",
)  # fmt: skip
"""Sum of the stiffnesses of the legs."""


def method_section() -> Section:
    """Write the section with the theory in two formulas."""
    source = f"Source: {CITATION}, and the documentation of kinetostat, theory."
    return Section(
        "Method",
        (Paragraph(THEORY_TEXT), Paragraph(LEGS_TEXT), LEG, Paragraph(SUM_TEXT), ASSEMBLY, Paragraph(source)),
    )


@dataclass(frozen=True)
class Origin:
    """The sources of a report.

    Attributes:
        command: the command that makes it again.
        inputs: name and text of each file, as written.
        machine_file: the machine with all overrides, all digits.
        results: the analysis as JSON.
    """

    command: str
    inputs: tuple[tuple[str, str], ...]
    machine_file: str
    results: str


def record_section(origin: Origin, engine: Sequence[str]) -> Section:
    """Write the section with the command, the versions and the input.

    Args:
        origin: the origin of the report.
        engine: name and version of the independent engine; empty without one.
    """
    versions = [(name, version(name)) for name in LIBRARIES] + [("Python", platform.python_version())]
    versions += [(engine[0], engine[1])] if engine else []
    return Section(
        "Record",
        (
            Paragraph(AGAIN_TEXT),
            Listing("Command.", origin.command),
            Table("Versions.", ("program", "version"), tuple(versions), (False, False)),
            *(Listing(f"Input: {name}.", text) for name, text in origin.inputs),
        ),
    )
