"""Stiffness against the stiffness of a link: when it no longer pays to make it stiffer."""

import math

from nicegui import ui

from kinetostat.studio.answers import Curves, CurveWish, Ends, Report, curves
from kinetostat.studio.controls import USUAL_STIFFNESS
from kinetostat.studio.elements import CurveView
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import full_label
from kinetostat.units import KINDS

DECADES = 1e3
"""How far the range goes up and down from the present value."""
BLOCKS = {"C, translation": ("compliance", "xyz"), "C, rotation": ("compliance", "r"),
          "K, translation": ("stiffness", "xyz"), "K, rotation": ("stiffness", "r")}  # fmt: skip


class LinkPanel(Panel):
    """Curves of K or C over one stiffness, the present value marked."""

    name = "Links"

    def build(self) -> None:
        """The choice of a stiffness and of what is drawn over it, and the curves."""
        self._session: Session | None = None
        self._lane = Lane(curves, self._draw)
        with ui.row().classes("panel-tools"):
            self.field = ui.select({}, label="stiffness of", on_change=self._ask)
            self.field.props("dense options-dense outlined").mark("link-field").classes("field grow")
            self.block = ui.select(list(BLOCKS), value="C, translation", label="shows", on_change=self._ask)
            self.block.props("dense options-dense outlined").mark("link-block").classes("field")
        self.curves = CurveView("stiffness of the machine over the stiffness of a link").mark("link-curves")

    def show(self, _report: Report, session: Session) -> None:
        """Draw anew for another machine or pose."""
        self._session = session
        fields = {path: full_label(c.parameter) for path, c in session.controls.items() if c.parameter.quantity.stiff}
        if self.field.options != fields:
            preferred = next((path for path in fields if "link" in path), next(iter(fields), None))
            kept = self.field.value if self.field.value in fields else preferred
            self.field.set_options(fields, value=kept)
        self._ask()

    def close(self) -> None:
        """Deliver nothing any more."""
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
        ends = Ends(path, middle / DECADES, middle * DECADES)
        self._lane.ask(CurveWish(self._session.machine, ends, quantities))

    def _draw(self, wish: CurveWish, found: Curves) -> None:
        if self._session is None or wish.field.path not in self._session.controls:
            return
        control = self._session.controls[wish.field.path]
        unit, (matrix, letters) = KINDS[control.parameter.quantity.kind].unit, BLOCKS[str(self.block.value)]
        units = {"compliance": ("rad/(N·m)", "m/N"), "stiffness": ("N·m/rad", "N/m")}[matrix]
        held = self._session.value(wish.field.path)
        data = {
            "x": found.across,
            "lines": [{"name": name.split("_")[1], "values": line} for name, line in found.values.items()],
            "label": {"x": f"{control.label} ({unit})", "y": f"{matrix} ({units[letters != 'r']})"},
            "unit": units[letters != "r"],
            "here": held if 0.0 < held < math.inf else None,
            "log": True,
        }
        self.curves.run_method("show", data)
