"""The formulas of the theory that a report quotes, for both writers: MathML for pages, Typst's mathematics for PDF."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Written:
    """One formula in both notations."""

    mathml: str
    typst: str


def _matrix(letter: str, below: str = "", above: str = "") -> str:
    """A bold letter with an index and a power, as MathML."""
    base = f'<mi mathvariant="normal" class="matrix">{letter}</mi>'
    if below and above:
        return f"<msubsup>{base}{below}{above}</msubsup>"
    return f"<msub>{base}{below}</msub>" if below else base


LEG, ELASTIC, PASSIVE, TRANSPOSED = (f"<mi>{letter}</mi>" for letter in ("i", "e", "p", "T"))
INVERSE = "<mrow><mo>−</mo><mn>1</mn></mrow>"
EQUALS, AND = "<mo>=</mo>", '<mo>,</mo><mspace width="2em"/>'

MOTION = [_matrix("w"), EQUALS, _matrix("K"), _matrix("t"), AND, _matrix("t"), EQUALS, _matrix("C"), _matrix("w")]
CARRIED = [_matrix("J", PASSIVE, TRANSPOSED), _matrix("W", LEG), EQUALS, "<mn>0</mn>"]
YIELDING = [
    _matrix("G", LEG), EQUALS, _matrix("W", LEG, TRANSPOSED), _matrix("J", ELASTIC), _matrix("S"),
    _matrix("J", ELASTIC, TRANSPOSED), _matrix("W", LEG),
]  # fmt: skip
SUM = [
    _matrix("K"), EQUALS, f"<munder><mo>∑</mo>{LEG}</munder>", _matrix("W", LEG), _matrix("G", LEG, INVERSE),
    _matrix("W", LEG, TRANSPOSED),
]  # fmt: skip

FORMULAS = {
    "motion": Written("".join(MOTION), "bold(w) = bold(K) thin bold(t), quad quad bold(t) = bold(C) thin bold(w)"),
    "leg": Written(
        "".join([*CARRIED, AND, *YIELDING]),
        "bold(J)_p^T bold(W)_i = 0, quad quad bold(G)_i = bold(W)_i^T bold(J)_e bold(S) bold(J)_e^T bold(W)_i",
    ),
    "assembly": Written("".join(SUM), "bold(K) = sum_i bold(W)_i bold(G)_i^(-1) bold(W)_i^T"),
}
"""By name: how loads and motions belong together, what a leg carries and how it yields, how legs add up."""
