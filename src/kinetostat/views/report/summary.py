"""The first sections: the results in sentences, each direction in a line, the machine, and every number of its file.

The machine has still pictures, and on a page a scene that turns under the mouse. Nothing is computed here but sums of
shares.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from kinetostat.display import Display, number
from kinetostat.equilibrium.state import state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.mobility import Mobility, SortOfPose
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import springs as springs_of
from kinetostat.spec.fields import NO_LIMIT
from kinetostat.spec.installation import extra_command
from kinetostat.studies.analysis import Analysis
from kinetostat.studies.attribution import largest_contributors, parts_and_kinds
from kinetostat.studies.guideline_sentences import statements
from kinetostat.studies.report import Answers
from kinetostat.studies.under_load import LoadedState
from kinetostat.studies.vibration import Vibration
from kinetostat.units import load_unit
from kinetostat.validation.comparison import Validation
from kinetostat.views.analysis_tables import first_lines, margin_sentence
from kinetostat.views.drawing import three_views
from kinetostat.views.loaded import KINDS_OF_LOADS, actuator_springs, loaded_lines
from kinetostat.views.picture import picture
from kinetostat.views.report.answers import gains, verdict_of
from kinetostat.views.report.content import (
    Block,
    Bullets,
    Figure,
    Paragraph,
    Section,
    Table,
    as_figure,
    as_table,
    typeset,
)
from kinetostat.views.scene import renderer_modules
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.machine_scene import machine_scene
from kinetostat.views.scene.overlays import overlays_of, swing_data
from kinetostat.views.scene.solids import Scene, Solid, as_data, solid_data
from kinetostat.views.tables import headline, machine_table, requirement_lines
from kinetostat.views.validation import verdict

PICTURE_SIZE = (800, 560)
"""Pixels of a picture of the machine: 200 to an inch at `PICTURE_WIDTH` of an A4 page. More would be seen in the time
alone: these take a quarter of a report's."""
PICTURE_WIDTH = 0.6
"""Width of that picture as a share of the width of the text: its caption and the text around it stay on the page."""
LOADED_LAYERS = ("load", "deflection")
"""Layers of a loaded machine."""
SWINGING_MODES = 6
"""Modes whose shapes swing on a page: the lowest ones, since each adds its solids to the file."""
NO_RENDERER = " To get a machine that you can turn with the mouse, run this before you make the report: {}."
"""Sentence of a page that cannot show the scene, because the renderer's libraries are not installed."""
LINES_OF_THE_POSE = ("Pose", "Margin")
"""Lines about the free machine that stand in the summary of a loaded one, whose stiffness is that at rest."""


def summary_section(answers: Answers, validation: Validation | str, portrait: Figure) -> Section:
    """Write the summary, with the requirements and a picture of the machine."""
    findings = Bullets(tuple((typeset(text), "") for text in _findings(answers, validation)))
    blocks = (*_answer_blocks(answers), *_requirements(answers), portrait, findings, _directions(answers))
    return Section("Summary", blocks)


def _answer_blocks(answers: Answers) -> Iterator[Block]:
    """Give the answer: pose, what holds under the loads and without them, the vibration, and the error as built."""
    state = answers.of("under_load")
    at_rest = state is not None and state.has_rest
    lines = [(head, text) for head, text in first_lines(answers.analysis) if not at_rest or head in LINES_OF_THE_POSE]
    pose, *others = [Paragraph(typeset(text), f"{head}:") for head, text in lines]
    yield pose
    if state is not None:
        yield verdict_of(state)
    if at_rest:
        yield from (Paragraph(typeset(text), f"{head}:") for head, text in loaded_lines(state))
    yield from others
    if at_rest:
        yield _demands(answers, state)
    for head, name in (("Vibration", "vibration"), ("As built", "budget")):
        if answer := answers.of(name):
            yield Paragraph(typeset(answer.message), f"{head}:")


def _demands(answers: Answers, state: LoadedState) -> Table:
    """Return a table of the displacements and errors of a loaded machine beside the requirements of its file."""
    display, vibration, error = answers.machine.display, answers.of("vibration"), answers.of("budget")
    displacement, rotation = map(display.show_deflection, state.tool_motion, ("m", "rad"))
    along, about = (_verdicts(answers, prefix, "xyz") for prefix in ("displacement_", "displacement_r"))
    rows = [
        ("displacement of the tool", displacement, along),
        ("rotation of the platform", rotation, about),
        *_actuator_demands(answers, state),
    ]
    if vibration and vibration.modes:
        first = display.show(vibration.modes[0].frequency, "Hz")
        rows.append(("first natural frequency", first, _verdicts(answers, "", ("frequency_1", "loaded_frequency_1"))))
    if error:
        usual = display.show_deflection(float(error.size("usual", "position")[0]), "m")
        rows.append(("error of the tool by tolerances, 95 %", usual, ""))
    cells = tuple((name, typeset(size), typeset(demand or "no requirement")) for name, size, demand in rows)
    caption = "The machine under its loads, and what its file demands."
    return Table(caption, ("", "at the pose", "demanded"), cells, (False, True, False))


def _actuator_demands(answers: Answers, state: LoadedState) -> Iterator[tuple[str, str, str]]:
    """Give the greatest load of the actuators of each kind, beside the limit and the requirements on it."""
    for turns, kind in KINDS_OF_LOADS:
        loads = [abs(spring.load) for spring in actuator_springs(state) if spring.turning is turns]
        if loads:
            shown = partial(answers.machine.display.show, unit=load_unit(turns))
            bound = getattr(answers.machine.tables["limits"], f"actuator_{kind}")
            used = f"at most {shown(bound)}: {number(100.0 * max(loads) / bound, digits=3)} % used"
            demands = [used if math.isfinite(bound) else "", _verdicts(answers, f"actuator_{kind}", ("",))]
            yield f"greatest {kind} of an actuator", shown(max(loads)), "; ".join(filter(None, demands))


def _verdicts(answers: Answers, prefix: str, names: Iterable[str]) -> str:
    """Return the conditions on some quantities, each with its verdict."""
    wanted = {f"{prefix}{name}" for name in names}
    judged = [verdict for verdict in answers.of("requirements") or () if verdict.quantity in wanted]
    return "; ".join(f"{each.condition}: {'met' if each.met else 'not met'}" for each in judged)


def _requirements(answers: Answers) -> tuple[Block, ...]:
    """Return the requirements of the file: how many are met, and each with its margin and worst pose."""
    judged, display = answers.of("requirements"), answers.machine.display
    if not judged:
        return ()
    lines = tuple((typeset(sentence), word) for _, word, sentence in requirement_lines(judged, display))
    return Paragraph(headline(judged), "Requirements:"), Bullets(lines)


def _findings(answers: Answers, validation: Validation | str) -> Iterator[str]:
    if answers.result is not None:
        yield " ".join([answers.result.message, *gains(answers.result)])
    advice = answers.of("guidelines")
    if advice is not None:
        yield from (statement.text for statement in statements(advice) if statement.topic == "weakest")
    yield validation if isinstance(validation, str) else verdict(validation)


def _directions(answers: Answers) -> Table:
    """Return each direction in a line: compliance, free and held stiffness, and the parts that contribute most."""
    analysis = answers.analysis
    display = analysis.machine.display
    heads = ("direction", "compliance C", "stiffness 1/C", "stiffness K", "mainly from")
    springs, rows = springs_of(state_of(analysis.machine).configuration), []
    for i, name in enumerate(analysis.components):
        soft, stiff = float(analysis.compliance_diagonal[i]), float(analysis.stiffness_diagonal[i])
        free = math.inf if soft == 0.0 else 1.0 / soft
        cells = [_shown_value(soft, f"compliance_{name}", "free", display)]
        cells += [_shown_value(k, f"stiffness_{name}", "rigid", display) for k in (free, stiff)]
        rows.append((name, *cells, _contributors(analysis, springs, i)))
    caption = (
        f"Each direction at the {analysis.machine.reference}: C is the motion by a unit load in the same direction, "
        "1/C the stiffness with all other motions free to follow, K the stiffness with all other motions held."
    )
    return Table(caption, heads, tuple(rows), (False, True, True, True, False))


def _shown_value(value: float, quantity: str, infinite: str, display: Display) -> str:
    return typeset(display.show(value, QUANTITIES[quantity].unit, infinite))


def _contributors(analysis: Analysis, springs: Sequence[Spring], i: int) -> str:
    """Name the parts that contribute most to the i-th entry of the diagonal of C."""
    shares = {part.spring: float(np.nan_to_num(part.compliance_share[i])) for part in analysis.attribution}
    return largest_contributors(*parts_and_kinds(springs, shares)) or "nothing"


@dataclass(frozen=True)
class MachinePictures:
    """A machine at its pose as solids.

    Attributes:
        scene: the machine.
        overlays: compliance ellipsoids, load and deflected shape.
        factor: the factor by which deflections are exaggerated; None without a load.
        swings: name of each mode of vibration, and its solids at both ends of their swing as plain data.
    """

    scene: Scene
    overlays: tuple[Solid, ...]
    factor: float | None
    swings: tuple[tuple[str, list[dict[str, Any]]], ...] = ()

    @property
    def data(self) -> dict[str, Any]:
        """Scene and overlays as plain data for the renderer of a page."""
        return {
            "scene": {**as_data(self.scene), "fit": True},
            "overlays": [solid_data(solid) for solid in self.overlays],
            "swings": [{"name": name, "solids": solids} for name, solids in self.swings],
        }

    def portrait(self) -> bytes:
        """Return a PNG of the machine."""
        return picture(self.scene, PICTURE_SIZE)

    def deflected_picture(self) -> bytes:
        """Return a PNG of the loaded machine with its deflected shape."""
        loaded = (solid for solid in self.overlays if solid.layer in LOADED_LAYERS)
        return picture(replace(self.scene, solids=(*self.scene.solids, *loaded)), PICTURE_SIZE)


def machine_pictures(analysis: Analysis, vibration: Vibration | None = None) -> MachinePictures:
    """Build the solids of an analysed machine with its overlays, and the swings of its modes where these are known."""
    machine = analysis.machine
    configuration = analysis.state.configuration
    sizes = proportions_of(machine, configuration)
    overlays, factor = overlays_of(analysis, sizes)
    swings = [
        (f"mode {number}, {machine.display.show(mode.frequency, 'Hz')}", solids)
        for number, mode in enumerate(vibration.modes[:SWINGING_MODES] if vibration else (), 1)
        if mode.shape is not None and (solids := swing_data(machine, configuration, sizes, mode.shape))
    ]
    return MachinePictures(machine_scene(machine, configuration, sizes), tuple(overlays), factor, tuple(swings))


def portrait(analysis: Analysis, pictures: MachinePictures, live: bool) -> Figure:
    """Return the picture of the machine on the first page.

    Args:
        analysis: the analysis at the pose.
        pictures: the pictures of the machine.
        live: whether the report will be a page, which shows the machine in three dimensions if it can.
    """
    machine, turning = analysis.machine, live and renderer_modules() is not None
    caption = f"{machine.name} at its pose: actuated legs blue, passive ones orange."
    if live and not turning:
        caption += NO_RENDERER.format(extra_command("report"))
    if turning and pictures.factor is not None:
        caption += f" Deflections are drawn {pictures.factor:,.6g} times as large as they are."
    if turning and pictures.swings:
        caption += " Modes of vibration swing as far as can be seen; their sizes say nothing."
    return Figure(caption, pictures.portrait(), PICTURE_WIDTH, pictures.data if turning else None)


def machine_section(analysis: Analysis) -> Section:
    """Write the section with drawings and mobility."""
    summary = Paragraph(_as_sentence(analysis.machine.family.summary))
    return Section("The machine", (summary, *_mobility(analysis), _drawing(analysis)))


def _drawing(analysis: Analysis) -> Figure:
    """Return front, side and plan of the machine; of a planar machine the plan alone."""
    views = "Plan" if analysis.machine.family.planar else "Front, side and plan"
    return as_figure(
        three_views(analysis.machine, ""),
        f"{views}, to scale; K, C and the load refer to {analysis.machine.reference[-1]}.",
    )


def _pose_kind(analysis: Analysis, mobility: Mobility) -> str:
    """Say in a sentence or two what kind of pose it is, and how far it is from a singularity."""
    kind = f"{mobility.kind} pose" if mobility.kind is SortOfPose.REGULAR else mobility.kind
    return f"{_as_sentence(kind)} {margin_sentence(analysis)}"


def _mobility(analysis: Analysis) -> tuple[Block, ...]:
    mobility = analysis.mobility
    if mobility is None:
        return ()
    redundant = f", {mobility.here.redundant} constraints redundant" if mobility.here.redundant else ""
    text = (
        f"{mobility.full_cycle} freedoms, {mobility.actuators} actuators{redundant}. {_pose_kind(analysis, mobility)} "
        "At a margin of 0 a leg locks up, or the platform moves although the actuators are locked."
    )
    return (Paragraph(typeset(text), "Mobility and singularity:"),)


def data_section(analysis: Analysis) -> Section:
    """Write the section with every number of the machine file."""
    table = as_table(machine_table(analysis.machine), "All values of the machine with their units; angles in degrees.")
    unset = [row[0].removeprefix("limits.") for row in table.rows if row[1] == NO_LIMIT]
    limits_set = replace(table, rows=tuple(row for row in table.rows if row[1] != NO_LIMIT))
    remarks = (Paragraph(f"{', '.join(unset)}.", "Limits that are not set:"),) if unset else ()
    return Section("Data sheet", (limits_set, *remarks))


def _as_sentence(text: str) -> str:
    """Return a phrase with a capital letter and a full stop."""
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"
