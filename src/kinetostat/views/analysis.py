"""Stiffness of a machine at its pose, free or at rest under its loads: one question, and a description for each state.

Nothing is computed here.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from rich.table import Table

from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.mobility import Mobility
from kinetostat.kinematics.status import Status
from kinetostat.late import LateModule
from kinetostat.machine.machine import Machine, pose_of
from kinetostat.machine.parameters import POSE, shown, values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import AXES, Analysis, analyze
from kinetostat.studies.analysis_parts import Indices
from kinetostat.views import analysis_tables as free
from kinetostat.views.analysis_tables import first_lines
from kinetostat.views.forward import actuator_coordinates
from kinetostat.views.question import (
    FIRST_FIELDS,
    MESSAGE,
    NAME,
    REQUIREMENTS,
    Description,
    Field,
    Lines,
    Option,
    Question,
    Records,
    requirements_met,
)

if TYPE_CHECKING:
    from kinetostat.equilibrium import solving
    from kinetostat.studies import requirements, under_load
    from kinetostat.studies.under_load import LoadedState
    from kinetostat.views import data_forms, loaded
else:
    solving = LateModule("kinetostat.equilibrium.solving")
    data_forms = LateModule("kinetostat.views.data_forms")
    requirements = LateModule("kinetostat.studies.requirements")
    under_load = LateModule("kinetostat.studies.under_load")
    loaded = LateModule("kinetostat.views.loaded")


def analyze_in_state(
    machine: Machine, axes: str = "base", along: Sequence[Sequence[float]] = ()
) -> "Analysis | LoadedState":
    """Analyse a machine in the state that is meant, and judge the requirements of its file.

    Args:
        machine: the machine with its pose.
        axes: "base", or "platform" for results of the free machine in platform axes.
        along: directions in which the stiffness of the free machine is given as well.

    Raises:
        InputError: axes or directions of a machine that is meant under its loads.
    """
    state = state_of(machine)
    verdicts = requirements.requirements(state) if machine.requirements else ()
    if not machine.loaded:
        analysis = analyze(state, axes)
        directions = tuple(map(analysis.along, along)) if analysis.status is Status.OK else ()
        return replace(analysis, directions=directions, requirements=verdicts)
    if along or axes != "base":
        raise InputError(
            '--loaded or state = "loaded" in [load] gives results in base axes only; leave '
            "--along and --axes out, or add --set load.state=free."
        )
    return replace(under_load.under_load(state), requirements=verdicts)


def _free_parts(analysis: Analysis, full: bool) -> Iterator[Table | str]:
    """Give the reasons as tables and remarks, K and C last; all springs if `full`."""
    if analysis.platform is None or not analysis.compliance_diagonal.size:
        return
    display, names = analysis.machine.display, analysis.components
    yield free.along_table(analysis.directions, display)
    yield free.shares_table(analysis, full)
    yield free.principal_table(analysis)
    if analysis.load:
        yield free.load_table(analysis.load, display)
        yield free.actuator_table(analysis.load, display)
        yield free.reaction_table(analysis.load, analysis.axes, display)
    yield from free.remarks(analysis)
    yield (
        f"Components {' '.join(names)} at the {analysis.machine.reference}, {analysis.axes} axes. Rank {analysis.rank}."
    )
    yield free.stiffness_table(analysis)
    yield free.compliance_table(analysis)
    if full:
        yield actuator_coordinates(analysis.actuators, display)
    if full and analysis.indices:
        yield free.eigenscrew_table(analysis.indices.eigenscrews, analysis.machine.reference, display)


def _loaded_lines(state: "LoadedState") -> Lines:
    yield "Pose", f"{pose_of(state.machine)}. {state.message}"
    if state.has_rest:
        yield from loaded.loaded_lines(state)
    cables = state.machine.tables["cables"]
    if cables.linear_density or cables.pulley_radius:
        yield "Cables", "Cables are straight here, without weight and pulleys; kinetostat tensions counts both."


def _loaded_parts(state: "LoadedState", full: bool) -> Iterator[Table | str]:
    if not state.has_rest:
        return
    display = state.machine.display
    yield loaded.displacement_table(state)
    yield loaded.springs_or_kinds_table(state, full)
    yield loaded.SIGNS if state.loaded else ""
    yield loaded.strut_table(state)
    yield f"Components {' '.join(state.components)} at the loaded {state.machine.reference}, base axes."
    for title, kind, rows in (
        ("Tangent stiffness", "stiffness", state.tangent),
        ("Elastic part of it", "stiffness", state.elastic),
        ("Compliance to further loads", "compliance", state.compliance),
    ):
        if rows is not None:
            yield free.matrix_table(title, kind, state.components, rows, display)


def _filled_parts(parts: Iterator[Table | str]) -> list[Table | str]:
    """Return the sentences, and the tables that have a row."""
    return [part for part in parts if part and (isinstance(part, str) or part.row_count)]


def _pose(analysis: Analysis) -> dict[str, Any]:
    return {shown(path): value for path, value in values(analysis.machine).items() if path.startswith(POSE)}


def _platform(analysis: Analysis) -> dict[str, Any]:
    position, rotation = analysis.platform or (None, None)
    return {"position": position, "rotation": rotation}


def _principal_compliances(indices: Indices) -> dict[str, Any] | None:
    """Return the principal compliances of each block with their directions; None where there are none."""
    blocks = (indices.principal_compliances or {}).items()
    return {block: {"values": c.compliances, "directions": c.directions} for block, c in blocks} or None


def _principal_stiffnesses(indices: Indices) -> dict[str, Any]:
    """Return the principal stiffnesses of each block, the other motions free or guided, with their directions."""
    blocks_by_kind = {"free": indices.free or {}, "guided": indices.guided or {}}
    return {
        kind: {block: {"values": k.stiffnesses, "directions": k.directions} for block, k in blocks.items()}
        for kind, blocks in blocks_by_kind.items()
    }


def _index_field(key: str, index_of: Callable[[Indices], Any], optional: bool = True) -> Field:
    """Return a field of one of the indices: None where there are none, NaN (null in JSON) where it has no value."""

    def take(analysis: Analysis) -> Any:
        if analysis.indices is None:
            return None
        value = index_of(analysis.indices)
        return math.nan if value is None else value

    return Field(key, take, optional=optional)


def _mobility(mobility: Mobility | None) -> dict[str, Any] | None:
    if mobility is None:
        return None
    return {
        "full_cycle": mobility.full_cycle,
        "here": mobility.here.platform,
        "legs": mobility.here.legs,
        "idle": mobility.here.idle,
        "redundant_constraints": mobility.here.redundant,
        "actuators": mobility.actuators,
        "kind": mobility.kind,
        "locked_legs": mobility.lost,
        "free_twists": mobility.twists,
        "leg_least_singular_value": mobility.leg_least_singular_value,
        "platform_least_singular_value": mobility.platform_least_singular_value,
    }


def _attribution(analysis: Analysis) -> list[dict[str, Any]]:
    return [
        {**vars(spring), "stiffness": data_forms.stiffness_of_spring(spring.stiffness)}
        for spring in analysis.attribution
    ]


ANALYSIS = Description(
    title="Stiffness",
    fields=(
        *FIRST_FIELDS,
        Field("family", "machine.family.name"),
        Field("components"),
        Field("axes"),
        Field("pose", _pose),
        Field("platform", _platform),
        Field("tool_offset", lambda analysis: analysis.machine.tables["tool"].offset),
        Field("stiffness"),
        Field(
            "compliance",
            lambda analysis: analysis.finite_compliance if analysis.compliance is None else analysis.compliance,
        ),
        Field(
            "stiffness_diagonal",
            lambda analysis: analysis.stiffness_diagonal if analysis.stiffness_diagonal.size else None,
        ),
        Field(
            "compliance_diagonal",
            lambda analysis: analysis.compliance_diagonal if analysis.compliance_diagonal.size else None,
        ),
        Field("rank"),
        Field("rigid"),
        Field("free"),
        Field("singularity_margin"),
        Field("leg_singularity_margin"),
        Field("platform_singularity_margin"),
        Field("wrench_condition"),
        Field("jacobian_condition"),
        Field("characteristic_length"),
        _index_field("principal_compliances", _principal_compliances, optional=False),
        _index_field("principal_stiffnesses", _principal_stiffnesses),
        _index_field("stiffness_condition", attrgetter("stiffness_condition")),
        _index_field("centres", attrgetter("centres")),
        _index_field("eigenscrews", attrgetter("eigenscrews")),
        Field("softest"),
        Field("along", "directions"),
        REQUIREMENTS,
        Field("mobility", lambda analysis: _mobility(analysis.mobility)),
        Field("internal_loads"),
        Field("load"),
        Field("actuators"),
        Field("moving_mass"),
        Field("masses", lambda analysis: {part.name: part.mass for part in analysis.masses}),
        Field("attribution", _attribution),
    ),
    lines=first_lines,
    tables=lambda analysis, full: _filled_parts(_free_parts(analysis, full)),
    answered=lambda analysis: analysis.status is Status.OK,
    kept=requirements_met,
    undrawn="analyze draws figures of the machine under load only; add --loaded, or leave -o out.",
)
SPRING = (  # values of each spring of a loaded machine
    Field("name"),
    Field("leg"),
    Field("turning"),
    Field("actuated"),
    Field("load", long_name="load that it carries, positive where it pulls, N or N·m"),
    Field("deformation", long_name="deformation from the free state, m or rad"),
    Field("slack"),
)
LOADED = Description(
    title="Under load",
    fields=(
        NAME,
        Field("family", "machine.family.name"),
        Field("rest", "rest.word"),
        MESSAGE,
        Field("components"),
        Field("displacement"),
        Field("linear"),
        Records("springs", "spring", SPRING),
        Field("slack_legs"),
        Field("elastic_stiffness", "elastic"),
        Field("tangent_stiffness", "tangent"),
        Field("tangent_compliance", "compliance"),
        Field("load_factor", "factor"),
        Field("mode"),
        Field("mode_legs"),
        Field("struts", lambda state: [{**asdict(strut), "factor": strut.factor} for strut in state.struts]),
        Field("snapped"),
        Field("residual"),
        Field("requirements"),
    ),
    lines=_loaded_lines,
    tables=lambda state, full: _filled_parts(_loaded_parts(state, full)),
    figures="views.loaded.loaded_figures",
    state=lambda state: f"under load: {state.rest.word}",
    answered=lambda state: state.has_rest,
    kept=lambda state: state.rest is not solving.Rest.JOINT_LIMIT and requirements_met(state),
)
ANALYZE_QUESTION = Question(
    example='kinetostat analyze mine.toml --set pose.x="5 mm" --json',
    answer=analyze_in_state,
    options=(
        Option("axes", "choice", "axes of the results (default: base)", default="base", choices=AXES),
        Option(
            "along",
            "direction",
            "also give the stiffness along (force) and about (moment) this direction; repeatable",
            many=True,
        ),
    ),
    loaded="at rest under gravity, preload and [load], with exact geometry: displacement, springs, stiffness",
    output="figures of the loaded machine: its shape, and the curve while the load grows",
    slow="computing; if the pose is out of reach, the nearest one is looked for",
    full="also show eigenscrews and every single spring",
)
