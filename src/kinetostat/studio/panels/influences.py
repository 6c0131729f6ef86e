"""Parts and numbers that make the machine compliant: shares of parts, sensitivities, curves over a stiffness.

The numbers come from `studies` and the engine; here they are ranked and written.
"""

import math
from collections.abc import Iterable

import numpy as np
from nicegui import ui

from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.machine import springs as springs_of
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.attribution import parts_and_kinds
from kinetostat.studies.sensitivity import Sensitivity
from kinetostat.studio.answers import (
    SINGULARITY,
    CurveRequest,
    Curves,
    Ends,
    RankingRequest,
    Report,
    curves,
    map_quantities,
    ranking,
)
from kinetostat.studio.controls import USUAL_STIFFNESS
from kinetostat.studio.elements import CurveView, choice, toggle
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import bars, engineering, full_label, heading, paragraph
from kinetostat.units import KINDS

LEAST_SHARE = 5e-4
"""Share of the compliance below which a part is left out: it would read 0.0 %."""
FIRST_RANKED = "free_stiffness_{}"
"""Quantity that is ranked until another is chosen; the braces are for the last component of the machine."""
MOST_PARAMETERS = 24
"""Greatest number of parameters that are listed: those of one screen."""
CURVE_SPAN = 1e3
"""Ratio of the ends of a curve to the present stiffness: it runs from the stiffness over this to it times this."""
BLOCKS = {"C, translation": ("compliance", False), "C, rotation": ("compliance", True),
          "K, translation": ("stiffness", False), "K, rotation": ("stiffness", True)}  # fmt: skip
"""Blocks of K and C whose diagonals are drawn: the matrix, and whether the components are rotations."""


class ContributionsPanel(Panel):
    """The share of each part in the compliance along or about one axis."""

    name = "Contributions"

    def build(self) -> None:
        self._report: Report | None = None
        self.component = toggle(["x"], "x", self._draw, "contributions-component")
        self.bars = ui.html("", sanitize=False).mark("contributions-bars")

    def show(self, report: Report, _session: Session) -> None:
        self._report = report
        names = list(report.analysis.components)
        if self.component.options != names:
            kept = self.component.value if self.component.value in names else names[-1]
            self.component.set_options(names, value=kept)
        self._draw()

    def _draw(self) -> None:
        if self._report is not None and self.component.value in self._report.analysis.components:
            self.bars.set_content(contributions_text(self._report, str(self.component.value)))


def contributions_text(report: Report, component: str) -> str:
    """Return bars of the parts that make one component of the compliance, by kind where that is shorter, then each.

    Args:
        report: the report of one pose.
        component: one of its component names, e.g. "rx".
    """
    analysis = report.analysis
    index = analysis.components.index(component)
    compliance = float(analysis.compliance_diagonal[index])
    shares: dict[str, float] = {}
    for spring in analysis.attribution:
        shares[spring.part] = shares.get(spring.part, 0.0) + float(np.nan_to_num(spring.compliance_share[index]))
    rows = _rows_of_shares(sorted(shares.items(), key=lambda item: -item[1]))
    if compliance == 0.0:
        return paragraph(f"The platform is rigid in {component}: no part deflects under this load.")
    if not rows:
        return paragraph(f"The platform moves freely in {component}: a spring there has no stiffness.")
    unit = QUANTITIES[f"compliance_{component}"].unit
    lead = f"Compliance in {component}: {engineering(compliance, unit, analysis.machine.display)}"
    springs = {each.spring: float(np.nan_to_num(each.compliance_share[index])) for each in analysis.attribution}
    _, shares_of_kinds = parts_and_kinds(springs_of(analysis.state.configuration), springs)
    kinds = _rows_of_shares(shares_of_kinds)
    by_kind = bars("contributions by kind of part", kinds) + heading("Part by part") if len(kinds) < len(rows) else ""
    return paragraph(lead, "lead") + by_kind + bars("contributions to the compliance", rows, report.legs)


def _rows_of_shares(shares: Iterable[tuple[str, float]]) -> list[tuple[str, float, str]]:
    """Return the rows of bars for shares of the compliance, without those that would read 0.0 %."""
    return [(name, share, f"{100 * share:.1f} %") for name, share in shares if share > LEAST_SHARE]


class SensitivityPanel(Panel):
    """The change of one quantity per percent of each parameter (of an angle: per 0.01 rad)."""

    name = "Sensitivity"

    def build(self) -> None:
        self._session: Session | None = None
        self._lane = Lane(ranking, self._draw)
        self.quantity = choice({}, "quantity", self._ask, "sensitivity-quantity")
        self.bars = ui.html("", sanitize=False).mark("sensitivity-bars")

    def show(self, report: Report, session: Session) -> None:
        self._session = session
        offered = map_quantities(report.analysis.machine).items()
        names = {name: text for name, text in offered if name != SINGULARITY}
        if self.quantity.options != names:
            first = FIRST_RANKED.format(report.analysis.components[-1])
            self.quantity.set_options(names, value=self.quantity.value if self.quantity.value in names else first)
        self._ask()

    def close(self) -> None:
        """Stop computing, because the page is gone."""
        self._lane.close()

    def _ask(self) -> None:
        if self._session is not None and self.quantity.value:
            if not self.bars.content:
                self.bars.set_content(paragraph("Being computed; the first time takes some seconds."))
            self._lane.ask(RankingRequest(self._session.machine, str(self.quantity.value)))

    def _draw(self, _request: RankingRequest, answer: Sensitivity | str) -> None:
        self.bars.set_content(paragraph(answer) if isinstance(answer, str) else ranking_text(answer))


def ranking_text(answer: Sensitivity) -> str:
    """Return the bars of the parameters that influence the first quantity of a sensitivity study."""
    percents = [(with_leg(answer.machine, p.path), p.percents[0]) for p in answer.parameters if p.percents.size]
    pairs = [(path, percent) for path, percent in percents if not math.isnan(percent)]
    largest = max((abs(percent) for _, percent in pairs), default=1.0)
    rows = [(path, percent / largest, f"{percent:+.3f}") for path, percent in pairs[:MOST_PARAMETERS]]
    if not rows:
        return paragraph(answer.message or "No parameter changes this quantity at this pose.")
    note = "Change of the quantity in percent, per percent of the parameter; of an angle, per 0.01 rad."
    if len(pairs) > MOST_PARAMETERS:
        note += f" {len(pairs) - MOST_PARAMETERS} parameters with less effect are omitted."
    return bars("sensitivities", rows) + paragraph(note)


class LinkPanel(Panel):
    """Curves of the diagonal of K or C over one stiffness, with the present value marked."""

    name = "Links"

    def build(self) -> None:
        self._session: Session | None = None
        self._lane = Lane(curves, self._draw)
        with ui.row().classes("panel-tools"):
            self.field = choice({}, "stiffness to vary", self._ask, "link-field").classes("grow")
            self.block = choice(list(BLOCKS), "curves of", self._ask, "link-block", "C, translation")
        self.curves = CurveView("stiffness of the machine over the stiffness of a part").mark("link-curves")

    def show(self, _report: Report, session: Session) -> None:
        self._session = session
        fields = {path: full_label(c.parameter) for path, c in session.controls.items() if c.parameter.quantity.stiff}
        if self.field.options != fields:
            preferred = next((path for path in fields if "link" in path), next(iter(fields), None))
            kept = self.field.value if self.field.value in fields else preferred
            self.field.set_options(fields, value=kept)
        self._ask()

    def close(self) -> None:
        """Stop computing, because the page is gone."""
        self._lane.close()

    def _ask(self) -> None:
        if self._session is None or self.field.value not in self._session.controls:
            return
        path = str(self.field.value)
        value = self._session.value(path)
        middle = value if 0.0 < value < math.inf else USUAL_STIFFNESS
        matrix, is_rotation = BLOCKS[str(self.block.value)]
        names = self._session.machine.family.component_names
        quantities = tuple(f"{matrix}_{name}" for name in names if name.startswith("r") is is_rotation)
        ends = Ends(path, middle / CURVE_SPAN, middle * CURVE_SPAN)
        self._lane.ask(CurveRequest(self._session.machine, ends, quantities))

    def _draw(self, request: CurveRequest, answer: Curves) -> None:
        """Draw the curves of a request, whose block and field need not be those that are chosen by now."""
        if self._session is None or request.field.path not in self._session.controls:
            return
        control = self._session.controls[request.field.path]
        matrix = request.quantities[0].partition("_")[0]
        x = self._session.machine.display.scale(KINDS[control.parameter.quantity.kind].unit)
        y = self._session.machine.display.scale(QUANTITIES[request.quantities[0]].unit)
        present = self._session.value(request.field.path) * x.factor
        data = {
            "x": [across * x.factor for across in answer.across],
            "lines": [
                {"name": name.split("_")[1], "values": [None if value is None else value * y.factor for value in line]}
                for name, line in answer.values.items()
            ],
            "label": {"x": x.label(full_label(control.parameter)), "y": y.label(matrix)},
            "unit": y.unit,
            "here": present if 0.0 < present < math.inf else None,
            "log": True,
        }
        self.curves.run_method("show", data)
