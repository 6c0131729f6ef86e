"""Natural frequencies and modes: a table, the chosen mode as a swing in the picture, and the tool's response.

`answers` computes modes and receptance (`ringing`) and the swing (`swing`); here they are chosen and shown.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.attribution import ranking_of
from kinetostat.studies.vibration import Mode
from kinetostat.studio.answers import Report, Ringing, SwingRequest, finite, ringing, swing, weighs
from kinetostat.studio.controls import SLIDER_STEPS
from kinetostat.studio.elements import CurveView, DesignTable, QuantityRow, choice, icon_button, toggle
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import bars, heading, paragraph, shown_value
from kinetostat.views.analysis_tables import entry_unit
from kinetostat.views.vibration import LEAST_SHARE, MOST_PARTS, cut_sentence, damping_sentence, mass_sentence, percent

MODES, RESPONSE = "Modes", "Response"
CUT = "the cut"
"""Name of the direction across the cut, in the place of a component."""
MODE_HEADS = ["frequency", "tool", "modal mass", "most strain energy", "most kinetic energy"]
COMPUTING = "Natural frequencies, modes and the response of the tool are being computed ..."
MASS_PATH = "tool.mass"
NO_MASS = "Nothing says what this machine weighs, and so its natural frequencies are not known."
MASS_HINT = (
    "Give the mass of platform and tool here, and the modes follow at once. Inertia, links, drives and damping are in "
    "the panel Mass."
)
LEAST_COUPLING = 1e-9
"""Share of the direct responses below which a response between two components is round-off."""
LARGEST_MASS = 1e300
"""In the place of an infinite modal mass, kg: a browser has no infinity."""
PLOT_DIGITS = 5
"""Significant digits of a point of a curve: finer than a pixel, and half of the bytes of a float."""


class VibrationPanel(Panel):
    """Modes and response of the tool; the chosen mode swings in the picture as long as the panel is in front."""

    name = "Vibration"

    def build(self) -> None:
        self._report: Report | None = None
        self._session: Session | None = None
        self._ringing: Ringing | None = None
        self._chosen, self._name = 0, ""
        self._front = self._is_moving = False
        self._moving: bool | None = None  # what was asked for by the button; None as the browser prefers
        self._modes, self._swings = Lane(ringing, self._deliver), Lane(swing, self._show_swing)
        self.view.on("swinging", self._show_play_state)
        self.about = ui.html("", sanitize=False).mark("vibration-about")
        self.mass = QuantityRow("mass of platform and tool", MASS_HINT, SLIDER_STEPS, slides=False).mark(
            "vibration-mass"
        )
        self.mass.on("write", self._take_mass)
        with ui.element("div").classes("vibration") as self.content:
            with ui.row().classes("panel-tools"):
                self.kind = toggle([MODES, RESPONSE], MODES, self._show_chosen_kind, "vibration-kind")
                ui.space()
                self.swinging = ui.label("").classes("note").mark("vibration-mode")
                self.play = icon_button("pause", "Play or pause the mode", self._play_or_pause, "vibration-play")
            self._build_modes()
            self._build_response()
        self._show_chosen_kind()

    def _build_modes(self) -> None:
        """Build the table of the modes, with the energies of the chosen one below it."""
        with ui.element("div").classes("vibration-part") as self.modes:
            self.table = DesignTable("natural vibrations; a row shows its mode", "show mode").mark("vibration-table")
            self.table.on("pick", self._pick)
            self.energies = ui.html("", sanitize=False).mark("vibration-energies")

    def _build_response(self) -> None:
        """Build the curves of the response, with the choice of the motion and of the load above them."""
        with ui.element("div").classes("vibration-part") as self.response:
            with ui.row().classes("panel-tools"):
                self.moved = choice({}, "motion of the tool", self._draw, "vibration-moved")
                self.pushed = choice({}, "under a load", self._draw, "vibration-pushed")
            self.none = ui.label("").classes("note").mark("vibration-uncoupled")
            self.size = CurveView("size of the tool's response over the frequency").mark("vibration-size")
            self.phase = CurveView("phase of the tool's response over the frequency").mark("vibration-phase")
            for curve in (self.size, self.phase):
                curve.on("pick", self._pick)

    def shows(self, report: Report) -> bool:
        return report.answered

    def show(self, report: Report, session: Session) -> None:
        self._report, self._session, self._front = report, session, True
        if self._name != session.machine.name:  # numbers of the same machine change in their places
            self._name = ""
            self.mass.set_visibility(False)
            self.content.set_visibility(False)
            self.about.set_content(paragraph(COMPUTING, "lead"))
        self._modes.ask(session.machine)

    def leave(self) -> None:
        self._front = False
        self.view.run_method("swing", [], False)

    def close(self) -> None:
        self._modes.close()
        self._swings.close()

    def _deliver(self, machine: Machine, new: Ringing | str) -> None:
        """Show new modes; of another machine from the lowest on."""
        if not self._front:
            return
        self._chosen, self._name = self._chosen if machine.name == self._name else 0, machine.name
        self._ringing = None if isinstance(new, str) or not new.answer.modes else new
        self.mass.set_visibility(isinstance(new, str) and not weighs(machine))
        self.content.set_visibility(self._ringing is not None)
        if self.mass.visible:
            self._ask_for_mass(machine)
        elif isinstance(new, str):
            self.about.set_content(paragraph(new, "lead"))
        else:
            self.about.set_content(about(new))
        if self._ringing is None:
            self.view.run_method("swing", [], False)
            return
        self._chosen = min(self._chosen, len(self._ringing.answer.modes) - 1)
        self._offer_directions(self._ringing)
        self._show_mode()

    def _ask_for_mass(self, machine: Machine) -> None:
        self.about.set_content(paragraph(NO_MASS, "lead") + paragraph(MASS_HINT))
        if self._session is not None:
            control = self._session.controls[MASS_PATH]
            self.mass.show_value(
                shown_value(control.parameter.quantity, self._session.value(MASS_PATH), machine.display), 0
            )

    def _take_mass(self, event: GenericEventArguments) -> None:
        """Give the machine the mass that was typed, or say why that is not possible."""
        if self._session is None:
            return
        try:
            self._session.write(MASS_PATH, str(event.args))
        except InputError as error:
            self.mass.complain(str(error))
        else:
            self.mass.replace_typed_text()
            self.show_change()

    def _offer_directions(self, new: Ringing) -> None:
        """Offer the components of the machine, and across the cut where the file says where that is."""
        machine = new.answer.machine
        names = [*new.answer.components, *([CUT] if any(machine.tables["cutting"].direction) else [])]
        options, first = {name: direction_phrase(name) for name in names}, new.answer.modes[0].direction
        for field in (self.moved, self.pushed):
            if field.options != options:
                field.set_options(options, value=field.value if field.value in options else first)

    def _show_chosen_kind(self) -> None:
        self.modes.set_visibility(self.kind.value == MODES)
        self.response.set_visibility(self.kind.value == RESPONSE)

    def _pick(self, event: GenericEventArguments) -> None:
        """Choose a mode, by a row of the table or by a mark of a curve."""
        if self._ringing is not None:
            self._chosen = min(int(event.args), len(self._ringing.answer.modes) - 1)
            self._show_mode()

    def _show_mode(self) -> None:
        """Show the chosen mode in the table, as energies, in the curves and as a swing of the picture."""
        if self._ringing is None or self._report is None:
            return
        answer, mode = self._ringing.answer, self._ringing.answer.modes[self._chosen]
        self.table.show_rows(*mode_rows(self._ringing), None, self._chosen)
        self.energies.set_content(energies_text(mode, self._chosen + 1, self._report.legs))
        self.swinging.set_text(f"mode {self._chosen + 1}, {answer.machine.display.show(mode.frequency, 'Hz')}")
        self._draw()
        self._swings.ask(SwingRequest(answer, self._chosen, self._report.sizes))

    def _show_swing(self, request: SwingRequest, solids: list[dict[str, Any]]) -> None:
        if self._front and self._ringing is not None and request.answer is self._ringing.answer:
            self.view.run_method("swing", solids, self._moving)

    def _play_or_pause(self) -> None:
        self._moving = not self._is_moving
        self.view.run_method("sway", self._moving)

    def _show_play_state(self, event: GenericEventArguments) -> None:
        """Follow the picture, which says whether the mode swings."""
        self._is_moving = bool(event.args)
        self.play.props(f"icon={'pause' if self._is_moving else 'play_arrow'}")

    def _draw(self) -> None:
        """Draw the entry of the receptance that is chosen."""
        if self._ringing is None or self._ringing.receptance is None or self._ringing.frequencies is None:
            return
        if self.moved.value is None or self.pushed.value is None:
            return  # both are about to be offered
        machine, receptance = self._ringing.answer.machine, self._ringing.receptance
        moved, pushed = str(self.moved.value), str(self.pushed.value)
        directions = [_unit_screw(machine, name) for name in (moved, pushed)]
        curve = _response_between(directions[0], receptance, directions[1])
        direct = [np.abs(_response_between(screw, receptance, screw)).max() for screw in directions]
        coupled = bool(np.abs(curve).max() > LEAST_COUPLING * math.sqrt(direct[0] * direct[1]))
        self.none.set_visibility(not coupled)
        self.none.set_text(f"A load {direction_phrase(pushed)} does not move the tool {direction_phrase(moved)}.")
        for view in (self.size, self.phase):
            view.set_visibility(coupled)
        unit = entry_unit("compliance", *("x" if name == CUT else name for name in (moved, pushed)))
        scale = machine.display.scale(unit)
        self._show_curve(self.size, np.abs(curve) * scale.factor, scale.label("size"), scale.unit, tall=True)
        self._show_curve(self.phase, np.degrees(np.unwrap(np.angle(curve))), "phase (deg)", "deg", signed=True)

    def _show_curve(self, view: CurveView, values: Array, label: str, unit: str, **options: bool) -> None:
        """Show values over the frequencies of the response, with a mark at each mode and one at the chosen mode."""
        if self._ringing is None or self._ringing.frequencies is None:
            return
        marks = [mode.frequency for mode in self._ringing.answer.modes]
        content = {
            "x": _plot_values(self._ringing.frequencies),
            "marks": marks,
            "here": marks[self._chosen],
            "log": True,
            "across": "Hz",
            "lines": [{"name": "", "values": _plot_values(values)}],
            "label": {"x": "frequency (Hz)", "y": label},
            "unit": unit,
        }
        view.run_method("show", content | options)


def about(new: Ringing) -> str:
    """Say what the first natural frequency is and why, what moves, and how it is damped."""
    answer = new.answer
    if not answer.modes:
        return paragraph(answer.message, "lead")
    details = f"{mass_sentence(answer)} Damping: {damping_sentence(answer)} {cut_sentence(answer)}"
    return paragraph(answer.message, "lead") + paragraph(details.rstrip())


def direction_phrase(name: str) -> str:
    """Return a component as a direction: "along x", "about x", "across the cut"."""
    if name == CUT:
        return f"across {CUT}"
    return f"about {name[1:]}" if name.startswith("r") else f"along {name}"


def mode_rows(new: Ringing) -> tuple[list[str], list[list[float]], list[list[str]]]:
    """Return the heads of the table of modes, numbers to sort its columns by, and its texts."""
    modes, display = new.answer.modes, new.answer.machine.display
    texts = [
        [
            display.show(mode.frequency, "Hz"),
            mode.direction,
            display.show(mode.modal_mass, "kg·m**2" if mode.direction.startswith("r") else "kg"),
            _largest(mode.kinds),
            _largest(mode.kinetic),
        ]
        for mode in modes
    ]
    ranks = [sorted({row[column] for row in texts}).index for column in range(len(MODE_HEADS))]
    values = [
        [mode.frequency, ranks[1](row[1]), min(mode.modal_mass, LARGEST_MASS), ranks[3](row[3]), ranks[4](row[4])]
        for mode, row in zip(modes, texts, strict=True)
    ]
    return MODE_HEADS, values, texts


def energies_text(mode: Mode, number: int, legs: Mapping[str, str]) -> str:
    """Return the bars of the energies of a mode: what deforms, by spring, and what moves, by part.

    Args:
        mode: the mode with its shares.
        number: the number of the mode, from 1.
        legs: legs by the name of a joint or link; the picture lights them with the bar under the pointer.
    """
    text = ""
    for title, shares in ((f"Strain energy of mode {number}", mode.strain), ("Its kinetic energy", mode.kinetic)):
        order = ranking_of({name: abs(share) for name, share in shares.items()})
        rows = [(name, shares[name], f"{percent(shares[name])} %") for name, size in order if size >= LEAST_SHARE]
        of_leg = {name: leg for name in shares for part, leg in legs.items() if f"{name} ".startswith(f"{part} ")}
        note = f"{len(rows) - MOST_PARTS} parts with less are omitted."
        text += heading(title) + bars(title, rows[:MOST_PARTS], of_leg)
        text += paragraph(note) if len(rows) > MOST_PARTS else ""
    return text


def _largest(shares: Mapping[str, float]) -> str:
    """Name the part with the largest share, with its percentage."""
    name, share = max(shares.items(), key=lambda item: item[1])
    return f"{name}, {100.0 * share:.0f}\N{NO-BREAK SPACE}%"


def _unit_screw(machine: Machine, name: str) -> Array:
    """Return a component, or the direction across the cut, as a unit wrench or twist [6]."""
    if name != CUT:
        return np.eye(len(COMPONENTS))[COMPONENTS.index(name)]
    direction = np.array(machine.tables["cutting"].direction)
    return np.concatenate([np.zeros(3), direction / np.linalg.norm(direction)])


def _response_between(moved: Array, receptance: Complex, pushed: Array) -> Complex:
    """Return the motion along one unit twist per unit of a wrench [frequencies]."""
    return np.asarray(np.einsum("i,fij,j->f", moved, receptance, pushed))


def _plot_values(values: Array) -> list[float | None]:
    """Return points of a curve in the digits that a plot can show."""
    return finite(np.array([float(f"{value:.{PLOT_DIGITS}g}") for value in values]))
