"""K or C over the stiffness of one part: the curve shows above which stiffness a stiffer part hardly helps.

The values along the curve are computed by `answers.curves`.
"""

import math

from nicegui import ui

from kinetostat.studio.answers import CurveRequest, Curves, Ends, Report, curves
from kinetostat.studio.controls import USUAL_STIFFNESS
from kinetostat.studio.elements import CurveView, choice
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import full_label
from kinetostat.units import KINDS

SPAN = 1e3
"""The curve runs from the present stiffness divided by this factor to the present stiffness times this factor."""
BLOCKS = {"C, translation": ("compliance", "xyz"), "C, rotation": ("compliance", "r"),
          "K, translation": ("stiffness", "xyz"), "K, rotation": ("stiffness", "r")}  # fmt: skip


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
        self._lane.close()

    def _ask(self) -> None:
        if self._session is None or self.field.value not in self._session.controls:
            return
        path = str(self.field.value)
        value = self._session.value(path)
        middle = value if 0.0 < value < math.inf else USUAL_STIFFNESS
        matrix, letters = BLOCKS[str(self.block.value)]
        names = [n for n in self._session.machine.family.component_names if (n[0] == "r") == (letters == "r")]
        quantities = tuple(f"{matrix}_{name}" for name in names)
        ends = Ends(path, middle / SPAN, middle * SPAN)
        self._lane.ask(CurveRequest(self._session.machine, ends, quantities))

    def _draw(self, request: CurveRequest, answer: Curves) -> None:
        if self._session is None or request.field.path not in self._session.controls:
            return
        control = self._session.controls[request.field.path]
        matrix, letters = BLOCKS[str(self.block.value)]
        units = {"compliance": ("rad/(N·m)", "m/N"), "stiffness": ("N·m/rad", "N/m")}[matrix]
        x = self._session.machine.display.scale(KINDS[control.parameter.quantity.kind].unit)
        y = self._session.machine.display.scale(units[letters != "r"])
        present = self._session.value(request.field.path) * x.factor
        data = {
            "x": [across * x.factor for across in answer.across],
            "lines": [
                {"name": name.split("_")[1], "values": [None if value is None else value * y.factor for value in line]}
                for name, line in answer.values.items()
            ],
            "label": {"x": x.label(control.label), "y": y.label(matrix)},
            "unit": y.unit,
            "here": present if 0.0 < present < math.inf else None,
            "log": True,
        }
        self.curves.run_method("show", data)
