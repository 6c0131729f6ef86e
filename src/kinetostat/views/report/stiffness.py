"""Sections on the stiffness: its theory in formulas, K and C, attribution, indices, load case, maps.

Nothing is computed here.
"""

import numpy as np
import xarray as xr

from kinetostat.display import DASH, number
from kinetostat.kinematics.status import Status
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.datasets import failures
from kinetostat.studies.printed_numbers import CITATION
from kinetostat.studies.report import NOTHING_TO_MAP, Answers
from kinetostat.views.analysis_tables import (
    actuator_table,
    block_units,
    compliance_table,
    eigenscrew_table,
    load_table,
    principal_table,
    reaction_table,
    remarks,
    shares_table,
    stiffness_table,
)
from kinetostat.views.figures import missing_line
from kinetostat.views.grid import axis_values, display_of
from kinetostat.views.grid_figures import grid_figure
from kinetostat.views.report.content import (
    Block,
    Figure,
    Formula,
    Paragraph,
    Section,
    Table,
    as_figure,
    as_table,
    typeset,
)
from kinetostat.views.report.summary import PICTURE_WIDTH, MachinePictures

BLOCK_UNITS = "Blocks: {}, {} and {} (rotation, coupling, translation)."
NO_LOAD = (
    "The machine file has no load. Add a table [load] with a force (N) and a moment (N·m) at the {} to see "
    "deflections, actuator loads and joint reactions here."
)
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


def stiffness_section(analysis: Analysis) -> Section:
    """Write the section with K and C at the pose, the attribution to parts, and the indices."""
    split = 3 if len(analysis.components) == 6 else 1
    meaning = (
        f"Components {' '.join(analysis.components)} at the {analysis.machine.reference}, {analysis.axes} axes; "
        "rotation first. A load w (moment, force) and the small motion t (rotation, translation) that it causes are "
        "related by"
    )
    matrices: list[Block] = [
        Paragraph(meaning),
        MOTION,
        as_table(stiffness_table(analysis), f"Stiffness K. {_blocks('stiffness', analysis)}", split),
        as_table(compliance_table(analysis), f"Compliance C. {_blocks('compliance', analysis)}", split),
    ]
    if analysis.stiffness is None or analysis.compliance is None:
        endless = [
            f"Some directions are {kind}: {matrix} is infinite there, so that its diagonal stands for it."
            for kind, matrix, values in (("rigid", "K", analysis.stiffness), ("free", "C", analysis.compliance))
            if values is None
        ]
        matrices.append(Paragraph(" ".join([*endless, f"Rank {analysis.rank}."])))
    return Section(
        "Stiffness at the pose",
        (
            Section("Stiffness and compliance", tuple(matrices)),
            Section("Attribution", _attribution(analysis)),
            Section("Indices", _indices(analysis)),
        ),
    )


def _blocks(kind: str, analysis: Analysis) -> str:
    """Name the units of the blocks of K or C."""
    return BLOCK_UNITS.format(*block_units(kind, analysis.machine.display))


def _attribution(analysis: Analysis) -> tuple[Block, ...]:
    states = [(names, word) for names, word in ((analysis.rigid, "Rigid"), (analysis.free, "Free")) if names]
    caption = "Shares of joints and links in the diagonal of C; each column adds up to 100 %."
    return (
        Paragraph(
            "C is a sum over the springs of the machine: each share is exact. A dash stands where nothing deflects."
        ),
        as_table(shares_table(analysis), caption),
        *(Paragraph(f"{', '.join(names)}.", f"{word}:") for names, word in states),
    )


def _indices(analysis: Analysis) -> tuple[Block, ...]:
    blocks: list[Block] = [Paragraph(typeset(line)) for line in remarks(analysis)]
    principal, display = principal_table(analysis), analysis.machine.display
    if principal.row_count:
        units = display.names(["N/m", "N·m/rad"])
        caption = f"Principal stiffnesses ({units}) and their directions x y z, the other motions free or held."
        blocks.append(as_table(principal, caption))
    eigenscrews = analysis.indices.eigenscrews if analysis.indices else ()
    screws = eigenscrew_table(eigenscrews, analysis.machine.reference, display)
    if screws.row_count:
        blocks.append(as_table(screws, f"Eigenscrews of the stiffness; points from the {analysis.machine.reference}."))
    return tuple(blocks)


def load_section(analysis: Analysis, pictures: MachinePictures) -> Section:
    """Write the section on the load of the file, or say how to add one."""
    point, display = analysis.machine.reference, analysis.machine.display
    if analysis.load is None:
        return Section("Load case", (Paragraph(NO_LOAD.format(point)),))
    loaded = load_table(analysis.load, display)
    tables = [
        (loaded, f"{str(loaded.title).replace('Load', f'The load at the {point}', 1)}."),
        (actuator_table(analysis.load, display), "Actuators under the load."),
        (
            reaction_table(analysis.load, analysis.axes, display),
            "Load that each joint passes on towards the base, at the joint "
            f"({display.names(['N·m', 'N'])}; {analysis.axes} axes).",
        ),
    ]
    blocks: list[Block] = [as_table(table, caption) for table, caption in tables if table.row_count]
    if pictures.factor is not None:
        caption = f"The load, and the deflected shape (red), {pictures.factor:,.6g} times as large as it is."
        blocks.append(Figure(caption, pictures.deflected_picture(), PICTURE_WIDTH))
    return Section("Load case, to first order" if analysis.machine.loaded else "Load case", tuple(blocks))


def workspace_section(answers: Answers) -> Section:
    """Write the section with maps of the diagonal of C, and its extremes."""
    title = "Over the poses"
    maps = answers.of("maps")
    if maps is None:
        return Section(title, (Paragraph("Maps were left out." if answers.ranges else NOTHING_TO_MAP),))
    return Section(title, tuple(_blocks_of_maps(maps)))


def _blocks_of_maps(maps: xr.Dataset) -> list[Block]:
    names = [str(name) for name in maps.data_vars if name != "status"]
    dims = [str(dim) for dim in maps["status"].dims]
    spans = [
        f"{label} from {values.min():.6g} to {values.max():.6g}"
        for values, label in (axis_values(maps, d) for d in dims)
    ]
    count = " by ".join(str(maps.sizes[dim]) for dim in dims)
    outcome = missing_line(failures(maps), maps["status"].size) or "every pose has an answer"
    setting = typeset(f"Over {' and '.join(spans)}: {count} points, all other values as in the data sheet; {outcome}.")
    if (maps["status"] != int(Status.OK)).all():
        return [Paragraph(setting)]
    return [
        Paragraph(setting),
        as_figure(grid_figure(maps, names, ""), "Compliance in each direction over the poses."),
        _extremes(maps, names),
    ]


def _extremes(maps: xr.Dataset, names: list[str]) -> Table:
    """Return the least and the greatest value of each quantity."""
    rows, display = [], display_of(maps)
    for name in names:
        values = maps[name].where(maps["status"] == int(Status.OK)).values
        if not np.isnan(values).all():
            least, greatest = float(maps[name].min()), float(maps[name].max())
            ratio = number(greatest / least) if least > 0.0 else DASH
            unit = maps[name].attrs["units"]
            texts = [typeset(display.number(value, unit, "free")) for value in (least, greatest)]
            rows.append((name.replace("_", " "), *texts, typeset(ratio), display.scale(unit).unit))
    heads = ("quantity", "least", "greatest", "ratio", "unit")
    return Table("Extremes over these poses.", heads, tuple(rows), (False, True, True, True, False))
