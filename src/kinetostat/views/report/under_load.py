"""The section on the machine at rest under its loads, where the file or the command wants it. Nothing is computed."""

from collections.abc import Iterator

from kinetostat.algebra.scalar import reciprocal
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.under_load import LoadedState
from kinetostat.views.loaded_figures import bars_figure, load_figure, shape_figure
from kinetostat.views.loaded_tables import displacement_table, spring_table, stability_of, strut_table, tangent_table
from kinetostat.views.report.content import Block, Paragraph, Section
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import printed, typeset


def loaded_section(state: LoadedState, analysis: Analysis) -> Section:
    """Write the section: verdict, shape, displacement, what each leg carries, stiffness, and the curve.

    Args:
        state: of the machine under its loads.
        analysis: of the machine without them.
    """
    return Section("Under load", tuple(_blocks(state, analysis)))


def verdict_of(state: LoadedState) -> Paragraph:
    """Say whether the machine is at rest, what is special, and how far the load may grow."""
    stability = f" {stability_of(state)}" if state.displacement else ""
    return Paragraph(typeset(f"{state.message}{stability}"), f"Under load, {state.rest.word}:")


def _blocks(state: LoadedState, analysis: Analysis) -> Iterator[Block]:
    yield verdict_of(state)
    if not state.displacement:
        return
    display = state.machine.display
    moved = displacement_table(state, display)
    yield drawn(shape_figure(state, ""), "The machine at rest under its loads over the machine without them.")
    yield printed(moved, f"{moved.title}, with exact geometry and by linear equations; base axes.")
    yield drawn(bars_figure(state), "What each leg carries.")
    yield printed(spring_table(state, display), "Load and deformation of every spring, and whether it carries.")
    if state.struts:
        yield printed(strut_table(state, display), "Struts, which bend away under Euler's load.")
    free = [reciprocal(compliance) for compliance in analysis.compliance_diagonal]
    tangent = tangent_table(state, free, analysis.stiffness_diagonal)
    if tangent is not None:
        caption = (
            "Stiffness that further loads meet, beside that of the free state: 1/C with all other motions free, K with "
            "all others held. The part of K under load that is not of springs is what loads and weights do by turning."
        )
        yield printed(tangent, caption)
    yield drawn(load_figure(state, ""), "Displacement and loads while the loads grow, beside the linear answer.")
