"""What to change first: parameters ranked by what a percent of each does to one index."""

from nicegui import ui

from kinetostat.machine.parameters import with_leg
from kinetostat.studies.sensitivity import Sensitivity
from kinetostat.studio.answers import RankingWish, Report, map_quantities, ranking
from kinetostat.studio.lanes import Lane
from kinetostat.studio.markup import bars, paragraph
from kinetostat.studio.session import Session

MOST = 24
"""Parameters that are shown."""


class SensitivityPanel:
    """Bars in percent per percent, of an angle per 0.01 rad, the greatest first."""

    name = "Sensitivity"

    def build(self) -> None:
        """The choice of an index, and the bars."""
        self._session: Session | None = None
        self._lane = Lane(ranking, self._draw)
        self.quantity = ui.select({}, label="index", on_change=self._ask).props("dense options-dense outlined")
        self.quantity.mark("sensitivity-quantity").classes("field")
        self.bars = ui.html("", sanitize=False).mark("sensitivity-bars")

    def show(self, report: Report, session: Session) -> None:
        """Rank anew for another machine or pose."""
        self._session = session
        names = {
            name: text for name, text in map_quantities(report.analysis.machine).items() if name != "singularity_margin"
        }
        if self.quantity.options != names:
            kept = self.quantity.value if self.quantity.value in names else list(names)[-1]
            self.quantity.set_options(names, value=kept)
        self._ask()

    def close(self) -> None:
        """Deliver nothing any more."""
        self._lane.close()

    def _draw(self, _wish: RankingWish, found: Sensitivity) -> None:
        self.bars.set_content(ranking_text(found))

    def _ask(self) -> None:
        if self._session is not None and self.quantity.value:
            self._lane.ask(RankingWish(self._session.machine, str(self.quantity.value)))


def ranking_text(found: Sensitivity) -> str:
    """The parameters with an influence on the first index, as bars."""
    percents = [(with_leg(found.machine, one.path), one.percents[0]) for one in found.influences if one.percents]
    known = [(path, percent) for path, percent in percents if percent is not None]
    largest = max((abs(percent) for _, percent in known), default=1.0)
    rows = [(path, percent / largest, f"{percent:+.3f}") for path, percent in known[:MOST]]
    if not rows:
        return paragraph(found.message or "No parameter has an influence here.")
    note = "Percent by which the index changes per percent of the parameter, of an angle per 0.01 rad."
    more = f" {len(known) - MOST} more have less." if len(known) > MOST else ""
    return bars("sensitivities", rows) + paragraph(note + more)
