"""The page of one designer: its session, its panels, and what is computed and shown when the machine changes.

The order is always the same: the session changes, the map and the picture are requested, then the report of the pose.
"""

import time
from collections.abc import Callable

from nicegui import events, ui

from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import bundled
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError
from kinetostat.studio.addresses import address_of
from kinetostat.studio.answers import Picture, PictureRequest, Report, ReportRequest, picture, report
from kinetostat.studio.design.design_tab import DesignTab, Workshop
from kinetostat.studio.elements import BrowserLink, icon_button, refuse, toggle, upload_field
from kinetostat.studio.lanes import Lane, as_sentence
from kinetostat.studio.map_panel import MapPanel
from kinetostat.studio.menus import FilesMenu, Gallery
from kinetostat.studio.panels import Panel
from kinetostat.studio.panels.influences import ContributionsPanel, LinkPanel, SensitivityPanel
from kinetostat.studio.panels.tables import IndicesPanel, LoadsPanel, MatricesPanel, RequirementsPanel
from kinetostat.studio.panels.vibration import VibrationPanel
from kinetostat.studio.parameters_panel import ParametersPanel
from kinetostat.studio.playback import DrivesPanel, Playback
from kinetostat.studio.processes import check_upload
from kinetostat.studio.pulling import free_axes
from kinetostat.studio.question_tab import AskTab
from kinetostat.studio.scene_panel import Handles, ScenePanel
from kinetostat.studio.session import Memory, Session
from kinetostat.studio.text_pane import TextPane
from kinetostat.views.scene.anatomy import proportions_of

PANELS: tuple[type[Panel], ...] = (
    ContributionsPanel, MatricesPanel, IndicesPanel, SensitivityPanel, LinkPanel, LoadsPanel, VibrationPanel,
    DrivesPanel, RequirementsPanel,
)  # fmt: skip
"""The linked views, in the order of their tabs."""
ACCENT = "#0b5ea8"
"""Colour of buttons and marks; style.css has it by name."""
MODES = {"Explore": "studio", "Text": "studio texting", "Design": "studio designing", "Ask": "studio asking"}
"""Panes beside the machine: its numbers, the text of its file, the design or the ask tab; also classes of the page."""
EXPLORE, TEXT, DESIGN, ASK = MODES
OWN_MACHINE = "own"
"""Key in the list of machines of one that is not bundled."""


class StudioPage:
    """The page of one browser tab, with a session that no other tab shares."""

    def __init__(self, memory: Memory, remember: Callable[[Memory, str], None], workshop: Workshop) -> None:
        """Build the page and request its first picture, map and report.

        Args:
            memory: state of this tab from which to go on.
            remember: called with the new state and its address whenever it changes.
            workshop: searches and favourites of the server.
        """
        self.session, self._remember = Session(memory), remember
        self._is_users_choice = False  # whether a change of the list of machines or of the switch is the designer's
        self._pictures = Lane(picture, self._show_picture, self._show_failure, lambda: self.scene.wait())
        self._reports = Lane(report, self._show_report, self._show_failure)
        self._latest: Report | None = None  # the last one with an answer
        self._front: Panel | None = None
        self.dark = ui.dark_mode(value=None)
        self.browser = BrowserLink().on("undo", self._undo).on("redo", self._redo).mark("browser")
        self.browser.on("theme", lambda event: self.dark.set_value(event.args))
        ui.colors(primary=ACCENT)
        self._header()
        with ui.element("main").classes("studio") as self.main:
            with ui.element("section").classes("left").props('aria-label="parameters"'):
                self.parameters = ParametersPanel(self.session, self.show_change, lambda: self._pictures.busy)
            with ui.element("section").classes("text-pane left").props('aria-label="machine file"'):
                self.text = TextPane(self.session, lambda machine: self._take(machine, typed=True))
            with ui.element("section").classes("middle").props('aria-label="machine"'):
                self.scene = ScenePanel(self._show_loaded, self._exaggerate, lambda: self.session.machine.name)
                self.handles = Handles(self.session, self.scene.view, self.show_change)
                with self.scene.tools:
                    self.playback = Playback(self.session, self.show_change, self._is_drawing)
            with ui.element("section").classes("right").props('aria-label="linked views"'):
                with ui.element("div").classes("card map-card"):
                    self.map = MapPanel(self.session, self.show_change)
                with ui.element("div").classes("card views-card"):
                    self._views()
            self.design = DesignTab(self.session, workshop, self._take)
            self.questions = AskTab(self.session)
        ui.context.client.on_delete(self._close)
        ui.on_exception(lambda error: refuse(f"Something could not be done or shown. {as_sentence(error)}"))
        self._show_machine()

    def _header(self) -> None:
        with ui.element("header").classes("top"):
            ui.html("kineto<b>stat</b> studio", sanitize=False).classes("wordmark")
            self.machines = ui.select({}, on_change=self._choose).mark("machines")
            self.machines.props('dense options-dense outlined aria-label="machine"').classes("field machine-choice")
            Gallery(lambda name: self._attempt(lambda: self.session.open(name)))
            self.undo = icon_button("undo", "Undo (Ctrl+Z)", self._undo, "undo")
            self.redo = icon_button("redo", "Redo (Ctrl+Y)", self._redo, "redo")
            self.reset = icon_button("restart_alt", "Back to the machine as it was loaded", self._reset, "restart_alt")
            self.mode = toggle([*MODES], EXPLORE, self._change_mode, "mode").classes("mode")
            ui.space()
            self.upload = upload_field(self._open_upload, refuse, "upload")
            icon_button("folder_open", "Open a machine file", lambda: self.upload.run_method("pickFiles"), "open")
            icon_button("download", "Save the machine as a file", self._save, "save")
            self.files = FilesMenu(self.session)
            icon_button("contrast", "Light or dark", lambda: self.browser.run_method("otherTheme"), "theme")

    def _views(self) -> None:
        self.panels: dict[str, Panel] = {}
        panels = [panel() for panel in PANELS]
        for panel in panels:
            panel.show_change, panel.view, panel.is_busy = self.show_change, self.scene.view, self._is_drawing
        with ui.tabs(on_change=self._change_panel).classes("panel-tabs").props("dense no-caps") as self.tabs:
            for panel in panels:
                ui.tab(panel.name).mark(f"tab-{panel.name}")
        with ui.tab_panels(self.tabs, value=panels[0].name, animated=False).classes("panel-body").props("keep-alive"):
            for panel in panels:
                with ui.tab_panel(panel.name):
                    panel.build()
                self.panels[panel.name] = panel

    def show_change(self) -> None:
        """Request map and picture for new numbers of the machine; the report follows the picture."""
        self.map.refresh(time.perf_counter())
        self._pictures.ask(PictureRequest(self.session.machine, self._sizes, self._axes))
        if self.scene.loaded.value is not self.session.machine.loaded:
            self._show_state()
            self.parameters.fill()
        else:
            self.parameters.refresh()
        self.text.refresh()
        self.questions.note_change()
        self._offer_history()

    def _is_drawing(self) -> bool:
        """Return whether the last change is still being drawn, by the server or in the browser."""
        return self._pictures.busy or self.scene.view.is_behind

    def _show_machine(self) -> None:
        """Show another machine: every control, list and picture is made again."""
        machine = self.session.machine
        names = {name: name for name in bundled()}
        options = names if self.session.name else {OWN_MACHINE: machine.name, **names}
        self._is_users_choice = False
        self.machines.set_options(options, value=self.session.name or OWN_MACHINE)
        self._is_users_choice = True
        ui.page_title(f"{machine.name} · kinetostat studio")
        self._sizes = proportions_of(machine, state_of(self.session.origin).configuration)
        self._axes = free_axes(machine)
        self.playback.clear()
        self._leave_front()
        self._show_state()
        self.parameters.fill()
        self.text.renew()
        self.map.fill()
        self.design.renew()
        self.questions.note_change()
        self._offer_history()
        self.map.refresh()
        self._pictures.ask(PictureRequest(machine, self._sizes, self._axes, fit=True))

    def _show_loaded(self, loaded: bool) -> None:
        """Show the machine under its loads or without them, which is a step of its history."""
        if self._is_users_choice and loaded is not self.session.machine.loaded:
            self.session.show_loaded(loaded)
            self.parameters.fill()
            self.show_change()

    def _show_state(self) -> None:
        """Bring the switch to the state of the machine."""
        self._is_users_choice = False
        self.scene.loaded.set_value(self.session.machine.loaded)
        self._is_users_choice = True

    def _offer_history(self) -> None:
        self.undo.set_enabled(self.session.can_undo)
        self.redo.set_enabled(self.session.can_redo)
        self.reset.set_enabled(self.session.machine is not self.session.origin)
        self._remember_state()

    def _remember_state(self) -> None:
        """Remember the state of the session, and show it in the address."""
        memory = self.session.memory
        address = address_of(memory)
        self._remember(memory, address)
        self.browser.show_query(address)

    def _show_picture(self, request: PictureRequest, drawn: Picture) -> None:
        """Draw, then let a waiting slider go on, then request the figures: the eye follows the picture first."""
        self.scene.draw(drawn)
        if drawn.status is Status.OUT_OF_REACH and request.machine.family.chains is not None:
            self.scene.look_for_nearest()
        self.parameters.take_waiting_position()
        self._report()

    def _show_failure(self, error: Exception) -> None:
        """Say that the machine could not be drawn or analysed, and let a waiting slider go on."""
        self.scene.fail(error)
        self.parameters.take_waiting_position()

    def _report(self) -> None:
        self._reports.ask(ReportRequest(self.session.machine, self._sizes, self.session.exaggeration))

    def _exaggerate(self, factor: float | None) -> None:
        """Draw the deflected shape with another factor; None to choose one."""
        self.session.exaggeration = factor
        self._remember_state()
        self._report()

    def _show_report(self, request: ReportRequest, latest: Report) -> None:
        self.scene.explain(latest, request.exaggeration is None)
        if latest.answered:
            self._latest = latest
            self._show_front()
        else:
            self._leave_front()

    def _change_panel(self) -> None:
        self._leave_front()
        self._show_front()

    def _show_front(self) -> None:
        """Show the latest answer in the panel in front, if the panel has something to say about it."""
        panel = self.panels.get(str(self.tabs.value))
        is_hidden = self.mode.value in (DESIGN, ASK)
        if self._latest is not None and panel is not None and panel.shows(self._latest) and not is_hidden:
            self._front = panel
            panel.show(self._latest, self.session)

    def _leave_front(self) -> None:
        if self._front is not None:
            self._front.leave()
        self._front = None

    def _choose(self) -> None:
        if self._is_users_choice and self.machines.value != OWN_MACHINE:
            name = str(self.machines.value)
            self._attempt(lambda: self.session.open(name))

    async def _open_upload(self, event: events.UploadEventArguments) -> None:
        data = await event.file.read()
        name = event.file.name
        try:
            await check_upload("machine", data, name, self.upload.client.id)
        except InputError as error:
            refuse(str(error))
        else:
            self._attempt(lambda: self.session.open_bytes(data, name))
        self.upload.reset()

    def _attempt(self, open_machine: Callable[[], None]) -> None:
        """Open another machine and show it, or say why it is refused."""
        try:
            open_machine()
        except InputError as error:
            refuse(str(error))
            return
        self._show_machine()

    def _change_mode(self) -> None:
        mode = str(self.mode.value)
        self.main.classes(replace=MODES[mode])
        if mode in (DESIGN, ASK):
            self._leave_front()
        elif self._front is None:
            self._show_front()
        self.text.set_front(mode == TEXT)
        self.design.set_front(mode == DESIGN)
        self.questions.set_front(mode == ASK)

    def _take(self, machine: Machine, typed: bool = False) -> None:
        """Make a design of a search, a favourite, or what was typed as text the machine of this page."""
        if self.session.take(machine, typed):
            self.show_change()
        else:
            self._show_machine()

    def _save(self) -> None:
        name, content = self.session.as_file()
        ui.download(content, name, "application/toml")

    def _undo(self) -> None:
        self.session.undo()
        self.show_change()

    def _redo(self) -> None:
        self.session.redo()
        self.show_change()

    def _reset(self) -> None:
        self.session.reset()
        self.show_change()

    def _close(self) -> None:
        lanes = (self._pictures, self._reports)
        for part in (*lanes, self.handles, self.map, self.files, self.text, self.design, self.questions):
            part.close()
        for panel in self.panels.values():
            panel.close()
