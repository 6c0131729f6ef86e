"""Sections about the pose: K and C, attribution, indices, and the load case. Nothing is computed here."""

from kinetostat.studies.analysis import Analysis
from kinetostat.views.analysis_tables import (
    UNITS_OF_C,
    UNITS_OF_K,
    actuator_table,
    compliance_table,
    eigenscrew_table,
    load_table,
    principal_table,
    reaction_table,
    remarks,
    shares_table,
    stiffness_table,
)
from kinetostat.views.report.content import Block, Figure, Formula, Paragraph, Section
from kinetostat.views.report.pictures import SHARE, Shown
from kinetostat.views.report.typesetting import printed, typeset

BLOCKS = "Blocks: {}, {} and {} (rotation, coupling, translation)."
NO_LOAD = (
    "The machine file has no load. Add a table [load] with a force (N) and a moment (N·m) at the {} to have "
    "deflections, actuator loads and joint reactions here."
)


def stiffness_section(found: Analysis) -> Section:
    """K, C, who is to blame, and what is read off them."""
    split = 3 if len(found.components) == 6 else 1
    about = (
        f"Components {' '.join(found.components)} at the {found.machine.reference}, {found.axes} axes; rotation first. "
        "A load w (moment, force) and the small motion t (rotation, translation) that it causes belong together by"
    )
    matrices: list[Block] = [
        Paragraph(about),
        Formula("motion"),
        printed(stiffness_table(found), f"Stiffness K. {BLOCKS.format(*UNITS_OF_K.split(', '))}", split),
        printed(compliance_table(found), f"Compliance C. {BLOCKS.format(*UNITS_OF_C.split(', '))}", split),
    ]
    if found.stiffness is None or found.compliance is None:
        endless = "rigid: K is infinite there" if found.stiffness is None else "free: C is infinite there"
        matrices.append(
            Paragraph(f"Some directions are {endless}, so that the diagonal stands for the matrix. Rank {found.rank}.")
        )
    return Section(
        "Stiffness at the pose",
        (
            Section("Stiffness and compliance", tuple(matrices)),
            Section("Attribution", _attribution(found)),
            Section("Indices", _indices(found)),
        ),
    )


def _attribution(found: Analysis) -> tuple[Block, ...]:
    states = [(names, word) for names, word in ((found.rigid, "Rigid"), (found.free, "Free")) if names]
    caption = "Shares of joints and links in the diagonal of C; each column adds up to 100 %."
    return (
        Paragraph(
            "C is a sum over the springs of the machine: each share is exact. A dash stands where nothing yields."
        ),
        printed(shares_table(found), caption),
        *(Paragraph(f"{', '.join(names)}.", f"{word}:") for names, word in states),
    )


def _indices(found: Analysis) -> tuple[Block, ...]:
    blocks: list[Block] = [Paragraph(typeset(line)) for line in remarks(found)]
    principal = principal_table(found)
    if principal.row_count:
        caption = "Principal stiffnesses (N/m, N·m/rad) and their directions x y z, the other motions free or held."
        blocks.append(printed(principal, caption))
    screws = eigenscrew_table(found.indices.eigenscrews if found.indices else (), found.machine.reference)
    if screws.row_count:
        blocks.append(printed(screws, f"Eigenscrews of the stiffness; points from the {found.machine.reference}."))
    return tuple(blocks)


def load_section(found: Analysis, pictures: Shown) -> Section:
    """The load case of the file, or how to have one."""
    point = found.machine.reference
    if found.load is None:
        return Section("Load case", (Paragraph(NO_LOAD.format(point)),))
    tables = [
        (load_table(found.components, found.load), f"The load at the {point} (N·m, N) and its deflection (rad, m)."),
        (actuator_table(found.load), "Actuators under the load."),
        (
            reaction_table(found.load, found.axes),
            f"Load that each joint passes on towards the base, at the joint (N·m, N; {found.axes} axes).",
        ),
    ]
    blocks: list[Block] = [printed(table, caption) for table, caption in tables if table.row_count]
    if pictures.factor is not None:
        caption = f"The load, and the deflected shape (red), {pictures.factor:,.6g} times as large as it is."
        blocks.append(Figure(caption, pictures.deflected(), SHARE))
    return Section("Load case", tuple(blocks))
