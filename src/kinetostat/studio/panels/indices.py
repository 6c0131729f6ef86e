"""Indices of the pose: principal stiffnesses, condition, mobility, centres."""

from nicegui import ui

from kinetostat.studies.analysis import Analysis
from kinetostat.studio.answers import Report
from kinetostat.studio.markup import heading, table
from kinetostat.studio.session import Session
from kinetostat.studio.wording import DASH, engineering

UNITS = {"translation": "N/m", "rotation": "N·m/rad"}


class IndicesPanel:
    """A page of figures."""

    name = "Indices"

    def build(self) -> None:
        """The figures, empty."""
        self.content = ui.html("", sanitize=False).mark("indices")

    def show(self, report: Report, _session: Session) -> None:
        """Show the figures of a new analysis."""
        self.content.set_content(indices_text(report.analysis))

    def close(self) -> None:
        """Nothing is under way."""


def indices_text(analysis: Analysis) -> str:
    """All indices as tables under headings."""
    return "".join([_principal(analysis), _pose(analysis), _centres(analysis)])


def _principal(analysis: Analysis) -> str:
    found = analysis.indices.free if analysis.indices else None
    rows = [
        [f"{block} {n}", engineering(k, UNITS[block]), ", ".join(f"{c:.3f}" for c in direction)]
        for block, one in (found or {}).items()
        for n, (k, direction) in enumerate(zip(one.stiffnesses, one.directions, strict=True), 1)
    ]
    title = "Principal stiffnesses"
    return heading(title) + table(title, ["", "stiffness", "direction"], rows)


def _pose(analysis: Analysis) -> str:
    found, indices = analysis.mobility, analysis.indices
    condition = engineering(analysis.jacobian_condition)
    rows = [
        ["condition of W", engineering(analysis.wrench_condition)],
        ["condition of the actuators' Jacobian", condition],
        ["condition of K", engineering(indices.condition if indices else None)],
        ["rank", str(analysis.rank)],
        ["characteristic length", engineering(analysis.length, "m")],
    ]
    if found is not None:
        rows += [
            ["kind of pose", str(found.kind)],
            ["freedoms", str(found.full_cycle)],
            ["actuators", str(found.actuators)],
            ["redundant constraints", str(found.here.redundant)],
            ["distance from a singularity, legs", f"{found.leg_distance:.4g} of 1"],
            ["distance from a singularity, platform", f"{found.platform_distance:.4g} of 1"],
        ]
    return heading("Pose") + table("Pose", ["", ""], rows)


def _centres(analysis: Analysis) -> str:
    centres = analysis.indices.centres if analysis.indices else {}
    rows = [
        [name, ", ".join(engineering(float(c), "m") for c in point) if point else DASH]
        for name, point in centres.items()
    ]
    title = f"Centres, from the {analysis.machine.reference}"
    return heading(title) + table(title, ["", "x, y, z"], rows)
