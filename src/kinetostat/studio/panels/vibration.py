"""Natural frequencies and modes: a table, the chosen mode as a swing in the picture, and the tool's response.

`answers` computes modes and receptance (`modes_and_response`) and the swing (`swing`); here they are chosen and shown.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studies.attribution import ranking_of
from kinetostat.studies.vibration import Mode, Vibration
from kinetostat.studio.answers import (
    ModesAndResponse,
    Report,
    SwingRequest,
    finite,
    has_mass,
    modes_and_response,
    swing,
)
from kinetostat.studio.controls import SLIDER_STEPS
from kinetostat.studio.elements import CurveView, DesignTable, QuantityRow, choice, icon_button, toggle
from kinetostat.studio.lanes import Lane
from kinetostat.studio.panels import Panel
from kinetostat.studio.session import Session
from kinetostat.studio.wording import bars, heading, paragraph, shown_value
from kinetostat.views.analysis_tables import entry_unit
from kinetostat.views.vibration import LEAST_SHARE, MOST_PARTS, cut_sentence, damping_sentence, mass_sentence, percent

MODES, RESPONSE = "Modes", "Response"
"""Parts of the panel, as the buttons name them."""
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
        self._vibrations: ModesAndResponse | None = None
        self._mode, self._machine_name = 0, ""  # the mode that is shown, from 0, and the machine that has it
        self._is_in_front = self._plays = False
        self._wanted_play_state: bool | None = None  # what the button asked for; None as the browser prefers
        self._answers, self._swings = Lane(modes_and_response, self._deliver), Lane(swing, self._show_swing)
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
                self.mode_label = ui.label("").classes("note").mark("vibration-mode")
                self.play = icon_button("pause", "Play or pause the mode", self._play_or_pause, "vibration-play")
            self._build_modes()
            self._build_response()
        self._show_chosen_kind()

    def _build_modes(self) -> None:
        """Build the table of the modes, with the energies of the chosen one below it."""
        with ui.element("div").classes("vibration-part") as self.modes_part:
            self.table = DesignTable("natural vibrations; a row shows its mode", "show mode").mark("vibration-table")
            self.table.on("pick", self._pick)
            self.energies = ui.html("", sanitize=False).mark("vibration-energies")

    def _build_response(self) -> None:
        """Build the curves of the response, with the choice of the motion and of the load above them."""
        with ui.element("div").classes("vibration-part") as self.response_part:
            with ui.row().classes("panel-tools"):
                self.motion_choice = choice({}, "motion of the tool", self._draw, "vibration-moved")
                self.load_choice = choice({}, "under a load", self._draw, "vibration-pushed")
            self.uncoupled_note = ui.label("").classes("note").mark("vibration-uncoupled")
            self.size_curve = CurveView("size of the tool's response over the frequency").mark("vibration-size")
            self.phase_curve = CurveView("phase of the tool's response over the frequency").mark("vibration-phase")
            for curve in (self.size_curve, self.phase_curve):
                curve.on("pick", self._pick)

    def shows(self, report: Report) -> bool:
        return report.answered

    def show(self, report: Report, session: Session) -> None:
        self._report, self._session, self._is_in_front = report, session, True
        if self._machine_name != session.machine.name:  # numbers of the same machine change in their places
            self._machine_name = ""
            self.mass.set_visibility(False)
            self.content.set_visibility(False)
            self.about.set_content(paragraph(COMPUTING, "lead"))
        self._answers.ask(session.machine)

    def leave(self) -> None:
        self._is_in_front = False
        self.view.run_method("swing", [], False)

    def close(self) -> None:
        self._answers.close()
        self._swings.close()

    def _deliver(self, machine: Machine, vibrations: ModesAndResponse | str) -> None:
        """Show new modes; of another machine from the lowest on."""
        if not self._is_in_front:
            return
        self._mode = self._mode if machine.name == self._machine_name else 0
        self._machine_name = machine.name
        self._vibrations = None if isinstance(vibrations, str) or not vibrations.answer.modes else vibrations
        self.mass.set_visibility(isinstance(vibrations, str) and not has_mass(machine))
        self.content.set_visibility(self._vibrations is not None)
        if self.mass.visible:
            self._ask_for_mass(machine)
        elif isinstance(vibrations, str):
            self.about.set_content(paragraph(vibrations, "lead"))
        else:
            self.about.set_content(about(vibrations))
        if self._vibrations is None:
            self.view.run_method("swing", [], False)
            return
        self._mode = min(self._mode, len(self._vibrations.answer.modes) - 1)
        self._offer_directions(self._vibrations.answer)
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

    def _offer_directions(self, answer: Vibration) -> None:
        """Offer the components of the machine, and across the cut where the file says where that is."""
        names = [*answer.components, *([CUT] if any(answer.machine.tables["cutting"].direction) else [])]
        options, first = {name: direction_phrase(name) for name in names}, answer.modes[0].direction
        for field in (self.motion_choice, self.load_choice):
            if field.options != options:
                field.set_options(options, value=field.value if field.value in options else first)

    def _show_chosen_kind(self) -> None:
        self.modes_part.set_visibility(self.kind.value == MODES)
        self.response_part.set_visibility(self.kind.value == RESPONSE)

    def _pick(self, event: GenericEventArguments) -> None:
        """Choose a mode, by a row of the table or by a mark of a curve."""
        if self._vibrations is not None:
            self._mode = min(int(event.args), len(self._vibrations.answer.modes) - 1)
            self._show_mode()

    def _show_mode(self) -> None:
        """Show the chosen mode in the table, as energies, in the curves and as a swing of the picture."""
        if self._vibrations is None or self._report is None:
            return
        answer, mode = self._vibrations.answer, self._vibrations.answer.modes[self._mode]
        self.table.show_rows(*mode_columns(answer), None, self._mode)
        self.energies.set_content(energies_text(mode, self._mode + 1, self._report.legs))
        self.mode_label.set_text(f"mode {self._mode + 1}, {answer.machine.display.show(mode.frequency, 'Hz')}")
        self._draw()
        self._swings.ask(SwingRequest(answer, self._mode, self._report.sizes))

    def _show_swing(self, request: SwingRequest, solids: list[dict[str, Any]]) -> None:
        if self._is_in_front and self._vibrations is not None and request.answer is self._vibrations.answer:
            self.view.run_method("swing", solids, self._wanted_play_state)

    def _play_or_pause(self) -> None:
        self._wanted_play_state = not self._plays
        self.view.run_method("sway", self._wanted_play_state)

    def _show_play_state(self, event: GenericEventArguments) -> None:
        """Follow the picture, which says whether the mode swings."""
        self._plays = bool(event.args)
        self.play.props(f"icon={'pause' if self._plays else 'play_arrow'}")

    def _draw(self) -> None:
        """Draw the entry of the receptance that is chosen."""
        if self._vibrations is None or self._vibrations.response is None:
            return
        if self.motion_choice.value is None or self.load_choice.value is None:
            return  # both are about to be offered
        machine, receptance = self._vibrations.answer.machine, self._vibrations.response.receptance
        motion_name, load_name = str(self.motion_choice.value), str(self.load_choice.value)
        twist, wrench = _unit_screw(machine, motion_name), _unit_screw(machine, load_name)
        response = _response_between(twist, receptance, wrench)
        direct_sizes = [np.abs(_response_between(screw, receptance, screw)).max() for screw in (twist, wrench)]
        is_coupled = bool(np.abs(response).max() > LEAST_COUPLING * math.sqrt(math.prod(direct_sizes)))
        self.uncoupled_note.set_visibility(not is_coupled)
        self.uncoupled_note.set_text(
            f"A load {direction_phrase(load_name)} does not move the tool {direction_phrase(motion_name)}."
        )
        for curve in (self.size_curve, self.phase_curve):
            curve.set_visibility(is_coupled)
        unit = entry_unit("compliance", *("x" if name == CUT else name for name in (motion_name, load_name)))
        scale, phases = machine.display.scale(unit), np.degrees(np.unwrap(np.angle(response)))
        self._show_curve(self.size_curve, np.abs(response) * scale.factor, scale.label("size"), scale.unit, tall=True)
        self._show_curve(self.phase_curve, phases, "phase (deg)", "deg", signed=True)

    def _show_curve(self, view: CurveView, values: Array, label: str, unit: str, **options: bool) -> None:
        """Show values over the frequencies of the response, with a mark at each mode and one at the chosen mode."""
        if self._vibrations is None or self._vibrations.response is None:
            return
        marks = [mode.frequency for mode in self._vibrations.answer.modes]
        content = {
            "x": _plot_values(self._vibrations.response.frequencies),
            "marks": marks,
            "here": marks[self._mode],
            "log": True,
            "across": "Hz",
            "lines": [{"name": "", "values": _plot_values(values)}],
            "label": {"x": "frequency (Hz)", "y": label},
            "unit": unit,
        }
        view.run_method("show", content | options)


def about(vibrations: ModesAndResponse) -> str:
    """Say what the first natural frequency is and why, what moves, and how it is damped."""
    answer = vibrations.answer
    if not answer.modes:
        return paragraph(answer.message, "lead")
    details = f"{mass_sentence(answer)} Damping: {damping_sentence(answer)} {cut_sentence(answer)}"
    return paragraph(answer.message, "lead") + paragraph(details.rstrip())


def direction_phrase(name: str) -> str:
    """Return a component as a direction: "along x", "about x", "across the cut"."""
    if name == CUT:
        return f"across {CUT}"
    return f"about {name[1:]}" if name.startswith("r") else f"along {name}"


def mode_columns(answer: Vibration) -> tuple[list[str], list[list[float]], list[list[str]]]:
    """Return the heads of the table of modes, numbers to sort its columns by, and its texts.

    Frequencies and masses are sorted as numbers, the other columns by the alphabet.
    """
    modes, display = answer.modes, answer.machine.display
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
    columns = [_alphabetical_ranks(column) for column in zip(*texts, strict=True)]
    columns[0] = [mode.frequency for mode in modes]
    columns[2] = [min(mode.modal_mass, LARGEST_MASS) for mode in modes]
    return MODE_HEADS, [list(row) for row in zip(*columns, strict=True)], texts


def _alphabetical_ranks(texts: Sequence[str]) -> list[float]:
    order = sorted(set(texts))
    return [float(order.index(text)) for text in texts]


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
        # A spring is named by its part, "leg 1 actuator axial"; the blank keeps "leg 1" apart from "leg 10".
        of_leg = {name: leg for name in shares for part, leg in legs.items() if f"{name} ".startswith(f"{part} ")}
        text += heading(title) + bars(title, rows[:MOST_PARTS], of_leg)
        if len(rows) > MOST_PARTS:
            text += paragraph(f"{len(rows) - MOST_PARTS} parts with less are omitted.")
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


def _response_between(twist: Array, receptance: Complex, wrench: Array) -> Complex:
    """Return the motion along one unit twist per unit of a wrench [frequencies]."""
    return np.asarray(np.einsum("i,fij,j->f", twist, receptance, wrench))


def _plot_values(values: Array) -> list[float | None]:
    """Return points of a curve in the digits that a plot can show."""
    return finite(np.array([float(f"{value:.{PLOT_DIGITS}g}") for value in values]))
