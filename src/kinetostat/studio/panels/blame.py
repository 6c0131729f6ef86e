"""Who is to blame: the share of every link, joint and actuator in the compliance of one direction."""

from nicegui import ui

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.studies.analysis import Analysis
from kinetostat.studio.answers import Report
from kinetostat.studio.markup import bars, paragraph
from kinetostat.studio.session import Session
from kinetostat.studio.wording import engineering

LEAST = 5e-4
"""Share below which a part is not worth a line."""


class BlamePanel:
    """Bars of the parts that make a direction soft, the greatest first."""

    name = "Blame"

    def build(self) -> None:
        """The choice of a direction, and the bars."""
        self._report: Report | None = None
        self.direction = ui.toggle(["x"], value="x", on_change=lambda: self._draw()).props(
            "dense no-caps unelevated toggle-text-color=accent-ink"
        )
        self.direction.mark("blame-direction").classes("choice")
        self.bars = ui.html("", sanitize=False).mark("blame-bars")

    def show(self, report: Report, _session: Session) -> None:
        """Show the shares of a new analysis."""
        self._report = report
        names = list(report.analysis.components)
        if self.direction.options != names:
            kept = self.direction.value if self.direction.value in names else names[-1]
            self.direction.set_options(names, value=kept)
        self._draw()

    def close(self) -> None:
        """Nothing is under way."""

    def _draw(self) -> None:
        if self._report is not None and self.direction.value in self._report.analysis.components:
            self.bars.set_content(blame(self._report.analysis, str(self.direction.value)))


def blame(analysis: Analysis, direction: str) -> str:
    """The parts that make a direction soft, as bars; each part's springs together."""
    place = analysis.components.index(direction)
    whole = analysis.compliance_diagonal[place]
    unit = QUANTITIES[f"compliance_{direction}"].unit
    parts: dict[str, float] = {}
    for share in analysis.shares:
        parts[share.part] = parts.get(share.part, 0.0) + (share.compliance[place] or 0.0)
    ranked = sorted(parts.items(), key=lambda item: -item[1])
    shown = [(name, part, f"{100 * part:.1f} %") for name, part in ranked if part > LEAST]
    if whole == 0.0:
        return paragraph(f"{direction} is rigid: no part yields in this direction.")
    if not shown:
        return paragraph(f"{direction} is free: a spring without stiffness lets it move.")
    title = f"Compliance along {direction}: {engineering(whole, unit)}"
    return paragraph(title, "lead") + bars(title, shown)
