"""What the load does: deflection of the tool, load and deformation of every actuator and spring."""

from nicegui import ui

from kinetostat.studies.analysis import Analysis
from kinetostat.studio.answers import Report
from kinetostat.studio.markup import heading, paragraph, table
from kinetostat.studio.session import Session
from kinetostat.studio.wording import engineering

ROTATIONS = ("rx", "ry", "rz")


class UnderLoadPanel:
    """Tables of a load case."""

    name = "Loads"

    def build(self) -> None:
        """The tables, empty."""
        self.content = ui.html("", sanitize=False).mark("under-load")

    def show(self, report: Report, _session: Session) -> None:
        """Show the load case of a new analysis."""
        self.content.set_content(load_text(report.analysis))

    def close(self) -> None:
        """Nothing is under way."""


def load_text(analysis: Analysis) -> str:
    """Deflection and spring loads as tables; how to set a load where there is none."""
    load = analysis.load
    if load is None:
        return paragraph("There is no load on the tool. Set a force or a moment in the panel Load on the left.")
    names = ("rx", "ry", "rz", "x", "y", "z")
    moved = [
        [name, engineering(w, "N·m" if name in ROTATIONS else "N"), engineering(d, "rad" if name in ROTATIONS else "m")]
        for name, w, d in zip(names, load.wrench, load.deflection, strict=True)
    ]
    springs = [
        [
            s.name,
            engineering(s.load, "N·m" if s.turning else "N"),
            engineering(s.deformation, "rad" if s.turning else "m"),
        ]
        for s in load.springs
    ]
    return (
        heading("Tool point")
        + table("tool point", ["", "load", "deflection"], moved)
        + heading("Actuators and springs")
        + table("actuators and springs", ["", "load", "gives"], springs)
    )
