"""Design guidelines of a machine: what each direction depends on, what counts as rigid, what to change.

They are derived at the pose of a machine and over a grid of poses: from the roles of the elastic elements in each
direction, and from the effects of the parameters of the design. Sentences are in `guideline_sentences`; what is printed
or drawn is in `views`.

Source: D. Zhang and C. M. Gosselin, Robotica 20(4), 429-438, 2002 ("the paper"), section 4.2, which derives them for
one machine.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from kinetostat.arrays import Array, Mask
from kinetostat.engine.batch import Progress, responses, silent
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import Points
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.elements import (
    Element,
    diagonal_with,
    element_share,
    elements,
    rigid_from,
    stiffness_equations,
    with_links_together,
    without_rounding,
)
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, Parameter, parameters, values
from kinetostat.spec.arguments import as_list, checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.spec.renamed import former_names
from kinetostat.studies.attribution import strongest_first
from kinetostat.studies.evaluation import PoseCount
from kinetostat.studies.poses import chosen_axes, grid_of
from kinetostat.studies.sensitivity import (
    Sensitivity,
    greatest_of,
    notes,
    percent_base,
    relative_sensitivity,
    sensitivity,
)
from kinetostat.tolerances import NO_ROLE

MOST_GUIDELINE_POSES = 10_000
"""Poses of a grid at most, because whole responses of all of them are kept in memory."""
EXCESS_OF_RIGID = 0.01
"""An element counts as rigid where its compliance adds less than this share to that of the machine with it rigid: one
per cent, because stiffnesses of parts are seldom known better."""
LEAST_INFLUENCE = 1e-3
"""Percent per percent below which a parameter counts as without effect on a direction: far above round-off, and so
little that twice the parameter changes a stiffness by a thousandth."""
REASON_WITHOUT_AXES = "as axes of joints, whose errors are a matter of tolerances: `kinetostat sensitivity` shows them"
"""The reason why directions are no parameters of the design."""
NOT_DESIGN = ("pose", "tool", "load", "limits", "linear_density")
"""Tables of a machine file whose values are not part of the design."""


@dataclass(frozen=True, eq=False)
class Roles(ImmutableAnswer):
    """The effect of each element on each direction, pose by pose; NaN where the direction is rigid or free.

    Attributes:
        shares: share of the element in each entry of the diagonal of C, 0 to 1 [elements x components x poses].
        rigid: the factor on the element's stiffness from which on it counts as rigid; infinite where nothing else is
            compliant, 0 where its compliance never matters [same shape].
        gains: the share by which an entry of C falls once the element is twice as stiff [same shape].
    """

    shares: Array
    rigid: Array
    gains: Array


@dataclass(frozen=True, eq=False)
class ParameterEffect(ImmutableAnswer):
    """The effect of a parameter of the design, or of all entries of a stiffness together, on the stiffness 1 / C_ii.

    Attributes:
        path: path of the parameter.
        percents: percent by which each direction gets stiffer per percent more of the parameter, or per 0.01 rad more
            of an angle; NaN where the direction is rigid or free.
        stiffer, softer: share of the poses of the grid at which each direction gets stiffer, and softer, by more than
            `LEAST_INFLUENCE`; empty without a grid.
        turning: whether the parameter is an angle.
    """

    path: str
    percents: Array
    stiffer: tuple[float, ...] = ()
    softer: tuple[float, ...] = ()
    turning: bool = False

    @property
    def matters(self) -> bool:
        """Whether it changes any direction, here or anywhere on the grid."""
        return self.greatest > LEAST_INFLUENCE or any(self.stiffer) or any(self.softer)

    @property
    def greatest(self) -> float:
        """Size of the greatest of the percents."""
        return greatest_of(self.percents)


@former_names(
    compliance="compliance_diagonal",
    found="elements",
    equations="stiffness_equations",
    moves="parameters",
    idle="without_influence",
    skipped="parameters_left_out",
    here="roles",
    left_out="parameters_left_out",
    everywhere="roles_over_grid",
    over_grid="roles_over_grid",
)
@dataclass(frozen=True, eq=False)
class Guidelines(AnswerInState):
    """Design guidelines.

    Attributes:
        state: state of the machine at its pose.
        status: status of the pose; all that follows is empty unless it is OK.
        message: one readable paragraph.
        components: names of the directions.
        compliance_diagonal: the diagonal of C.
        elements: the elastic elements, actuators first.
        roles: their roles at the pose of the file; None unless the status is OK.
        stiffness_equations: coefficients of each element in the diagonal of K; None where K is not a sum over elements.
        meaning: a sentence on the meaning of the percentages in `parameters`.
        parameters: the effects of the parameters of the design, the largest first.
        without_influence: paths of parameters that change no direction, here or anywhere on the grid.
        parameters_left_out: path of each parameter without a derivative, and the reason.
        ranges: ranges of the grid, as written.
        poses: number of poses of the grid with an answer, and of all its poses; zeros without a grid.
        roles_over_grid: roles at the poses of the grid with an answer; None where no pose has one.
        loads_left_out: a sentence on the loads of the file that do not count; empty where all do.
    """

    state: MachineState
    status: Status
    message: str
    components: tuple[str, ...]
    compliance_diagonal: Array = field(default_factory=lambda: np.zeros(0))
    elements: tuple[Element, ...] = ()
    roles: Roles | None = None
    stiffness_equations: dict[str, Array] | None = None
    meaning: str = ""
    parameters: tuple[ParameterEffect, ...] = ()
    without_influence: tuple[str, ...] = ()
    parameters_left_out: tuple[tuple[str, str], ...] = ()
    ranges: tuple[str, ...] = ()
    poses: PoseCount = PoseCount(0, 0)
    roles_over_grid: Roles | None = None
    loads_left_out: str = ""

    def __repr__(self) -> str:
        count = len(self.parameters)
        return f"<Guidelines for {self.machine.name!r}: {self.status.word}, {count} parameters that matter>"

    @property
    def actuator(self) -> Element | None:
        """The first group of actuators that all have one finite stiffness, to compare others with."""
        alike = (part for part in self.elements if part.actuated and part.stiffness and part.stiffness < math.inf)
        return next(alike, None)


@checked
def guidelines(machine: Machine | MachineState, ranges: Sequence[str] = (), progress: Progress = silent) -> Guidelines:
    """Derive what the stiffness of a machine depends on, at its pose and over a grid.

    Args:
        machine: a machine with its pose, or its state, as `state_of` returns it.
        ranges: ranges of the grid, "FIELD=from:to:count", coordinates of the pose; none for the file's pose alone.
        progress: receives how far the work is.

    Raises:
        InputError: a bad range, one that is not of a coordinate of the pose, or too many poses.
    """
    state, ranges = state_of(machine), as_list(ranges)
    machine = state.machine
    grid = _grid(machine, ranges) if ranges else None
    sensitivities = sensitivity(state)
    unanswered = Guidelines(
        state=state,
        status=sensitivities.status,
        message=sensitivities.message,
        components=machine.family.component_names,
        loads_left_out=sensitivities.loads_left_out,
    )
    if sensitivities.status is not Status.OK:
        return unanswered
    components, response = list(machine.family.components), state.free
    single_elements = elements(response.configuration)
    all_elements = with_links_together(single_elements)
    diagonal = without_rounding(response.compliance.diagonal(), response)[components, 0]
    effects = effects_of_parameters(sensitivities, diagonal > 0.0)
    roles_over_grid, poses = None, PoseCount(0, 0)
    if grid is not None:
        roles_over_grid, poses = roles_over(machine, grid, all_elements, components, progress)
        effects = with_signs_over_grid(state, grid, effects)
    by_path = parameters_by_path(machine)
    without_derivative = [pair for pair in sensitivities.without_derivative if is_of_design(by_path[pair[0]])]
    return replace(
        unanswered,
        compliance_diagonal=diagonal,
        elements=tuple(all_elements),
        roles=roles_at(response, all_elements, components),
        stiffness_equations=equations_of_k(response, single_elements, components),
        meaning=next(notes(sensitivities)),
        parameters=tuple(effect for effect in effects if effect.matters),
        without_influence=tuple(effect.path for effect in effects if not effect.matters),
        parameters_left_out=(*without_derivative, *axes_left_out(sensitivities)),
        ranges=tuple(ranges),
        poses=poses,
        roles_over_grid=roles_over_grid,
    )


def _grid(machine: Machine, ranges: Sequence[str]) -> Points:
    axes = chosen_axes(machine, ranges)
    for _, parameter in axes:
        if not parameter.path.startswith(POSE):
            known = ", ".join(path for path in values(machine) if path.startswith(POSE))
            raise InputError(f"{parameter.path} is not a coordinate of the pose; ranges (--over) are of {known}.")
    grid = grid_of(axes)
    if grid.size > MOST_GUIDELINE_POSES:
        raise InputError(
            f"the grid has {grid.size:,} poses; at most {MOST_GUIDELINE_POSES:,} are allowed: lower a count."
        )
    return grid


def roles_at(response: Response, elastic_elements: Sequence[Element], components: Sequence[int]) -> Roles:
    """Compute the roles of elements.

    Args:
        response: response at one pose, or at many as arrays.
        elastic_elements: the elements.
        components: numbers of those of rx ry rz x y z, 0 to 5, that the machine has.
    """
    with np.errstate(all="ignore"):  # the diagonal of C is 0 in rigid directions, infinite in free ones
        diagonal = without_rounding(response.compliance.diagonal(), response)[components]
        roles = [_roles_of_element(response, element, diagonal, components) for element in elastic_elements]
    if not roles:
        none = np.zeros((0, *np.shape(diagonal)))
        return Roles(shares=none, rigid=none, gains=none)

    def stack(rows: Iterable[Array]) -> Array:
        return np.stack(np.broadcast_arrays(*rows))

    return Roles(
        shares=stack(each.shares for each in roles),
        rigid=stack(each.rigid for each in roles),
        gains=stack(each.gains for each in roles),
    )


def _roles_of_element(response: Response, element: Element, diagonal: Array, components: Sequence[int]) -> Roles:
    """The roles of one element [components x poses], whose shares and gains are NaN in rigid and in free directions.

    Its limit of rigidity is known in a rigid direction, too. `diagonal` is that of C.
    """
    bounded = np.isfinite(diagonal)
    is_compliant = (diagonal > 0.0) & bounded
    divisor = np.where(is_compliant, diagonal, math.nan)
    # The part of a rigid element is that of a compliance of 1: it has a role, but no share.
    part = without_rounding(element_share(response, element), response)[components]
    has_role = part / np.where(is_compliant, diagonal, 1.0) > NO_ROLE
    elastic_part = np.where(has_role & (element.stiffness != math.inf), part, 0.0)
    factor = np.where(has_role, 1.0 / rigid_from(response, element, EXCESS_OF_RIGID)[components], 0.0)
    diagonal_if_doubled = without_rounding(diagonal_with(response, element, 0.5), response)[components]
    return Roles(
        shares=elastic_part / divisor,
        rigid=np.where(bounded, factor, math.nan),
        gains=1.0 - diagonal_if_doubled / divisor,
    )


def roles_over(
    machine: Machine, grid: Points, elastic_elements: Sequence[Element], components: Sequence[int], progress: Progress
) -> tuple[Roles | None, PoseCount]:
    """Compute roles at the poses of a grid that have an answer.

    Args:
        machine: the machine, with the values that do not vary.
        grid: the poses.
        elastic_elements, components: as for `roles_at`.
        progress: receives how far the work is.

    Returns:
        The roles, None where no pose has an answer; and the number of poses.
    """
    response = responses(machine, grid)
    progress(1, 2)
    has_answer = np.broadcast_to(np.asarray(response.status) == Status.OK, (grid.size,))
    roles = roles_at(response, elastic_elements, components)
    progress(2, 2)
    shape = (len(elastic_elements), len(components), grid.size)
    answered = [np.broadcast_to(rows, shape)[:, :, has_answer] for rows in (roles.shares, roles.rigid, roles.gains)]
    poses = PoseCount(answered=int(has_answer.sum()), total=grid.size)
    return Roles(*answered) if poses.answered else None, poses


def stiffening(state: MachineState, element: Element, factors: Array) -> Array:
    """Compute the stiffness 1 / C_ii of each direction while an element changes, over that with the element rigid.

    Args:
        state: state of the machine at its pose.
        element: the element whose stiffness is multiplied.
        factors: factors on its stiffness; of an element that is rigid, its stiffness itself (SI) [points].

    Returns:
        The ratio [components x points], 1 at most; 0 where nothing else is compliant.
    """
    components, response = list(state.machine.family.components), state.free
    with np.errstate(all="ignore"):  # rigid directions have no compliance, free ones an infinite one
        with_rigid = without_rounding(diagonal_with(response, element, 0.0), response)[components]
        return with_rigid / without_rounding(diagonal_with(response, element, 1.0 / factors), response)[components]


def equations_of_k(
    response: Response, single_elements: Sequence[Element], components: Sequence[int]
) -> dict[str, Array] | None:
    """Collect the coefficients of each element in the diagonal of K, eqs. 33-38, without round-off.

    Args:
        response: response at one pose.
        single_elements: the elements, each link by itself.
        components: as for `roles_at`.

    Returns:
        Coefficients by name of the element [components]; None where K is not a sum over elements.
    """
    by_element = stiffness_equations(response, single_elements)
    if by_element is None:
        return None
    rows = np.array([[float(matrix.entry(i, i)) for i in components] for matrix in by_element.values()])
    return dict(zip(by_element, np.where(rows > NO_ROLE * rows.max(axis=0, initial=0.0), rows, 0.0), strict=True))


def effects_of_parameters(sensitivities: Sensitivity, compliant: Mask) -> list[ParameterEffect]:
    """List the effects of the parameters of the design, the largest first; entries of one stiffness change together.

    Args:
        sensitivities: sensitivities of the diagonal of C.
        compliant: whether each direction is neither rigid nor free.
    """
    by_path, numbers = parameters_by_path(sensitivities.machine), values(sensitivities.machine)
    percents_of_entries: dict[str, list[Array]] = {}
    for influence in sensitivities.parameters:
        if is_of_design(by_path[influence.path]):
            percents = np.where(compliant, -influence.percents, math.nan)  # stiffer is less compliant
            path = _path_of_element(influence.path, by_path, numbers)
            percents_of_entries.setdefault(path, []).append(percents)
    percents_by_path = {path: np.sum(entries, axis=0) for path, entries in percents_of_entries.items()}
    no_effect = np.where(compliant, 0.0, math.nan)
    for path in sensitivities.without_influence:
        if is_of_design(by_path[path]):
            percents_by_path.setdefault(_path_of_element(path, by_path, numbers), no_effect)
    angles = {path for path in percents_by_path if by_path[path].quantity.kind == "angle"}
    return strongest_first([ParameterEffect(p, row, turning=p in angles) for p, row in percents_by_path.items()])


def is_of_design(parameter: Parameter) -> bool:
    """Whether a parameter is one that a designer chooses."""
    return parameter.path.split(".")[0] not in NOT_DESIGN and parameter.quantity.kind != "direction"


def axes_left_out(sensitivities: Sensitivity) -> list[tuple[str, str]]:
    """The axes of joints that have an influence, with the reason why they are left out."""
    axes = (p.path.rpartition(".")[0] for p in sensitivities.parameters if p.kind == "direction")
    return [(path, REASON_WITHOUT_AXES) for path in dict.fromkeys(axes)]


def parameters_by_path(machine: Machine) -> dict[str, Parameter]:
    """All parameters of a machine by their paths."""
    return {parameter.path: parameter for parameter in parameters(machine.family)}


def _path_of_element(path: str, by_path: Mapping[str, Parameter], numbers: Mapping[str, float]) -> str:
    """The path of a whole field where its entries are stiffnesses of springs that are one element; else the path."""
    path_of_field = path.rpartition(".")[0]
    parameter = by_path.get(path_of_field)
    if parameter is None or not (parameter.quantity.stiff and parameter.quantity.per_leg):
        return path
    return path_of_field if len({numbers[leaf] for leaf in parameter.leaves}) == 1 else path


def with_signs_over_grid(
    state: MachineState, grid: Points, effects: Sequence[ParameterEffect]
) -> list[ParameterEffect]:
    """Add to each effect at which share of the poses of a grid it stiffens a direction, and at which it softens it."""
    machine, by_path = state.machine, parameters_by_path(state.machine)
    leaves_of_effects = dict.fromkeys(leaf for effect in effects for leaf in by_path[effect.path].leaves)
    row_of_leaf = {leaf: row for row, leaf in enumerate(leaves_of_effects)}
    names = [f"compliance_{name}" for name in machine.family.component_names]
    answer = evaluate_gradient(machine, grid, names, list(row_of_leaf))
    has_answer = answer.status == Status.OK
    if not has_answer.any():
        return list(effects)
    length, numbers = float(state.configuration.length), values(machine)
    effects_with_signs = []
    for effect in effects:
        leaves = by_path[effect.path].leaves
        rows = [row_of_leaf[leaf] for leaf in leaves]
        sizes = np.array([percent_base(by_path[leaf].quantity.kind, numbers[leaf], length).amount for leaf in leaves])
        percents = relative_sensitivity(answer.gradients[:, rows], sizes[:, None], answer.values[:, None])
        stiffening_percents = -np.nansum(percents, axis=1)[:, has_answer]
        stiffer = (stiffening_percents > LEAST_INFLUENCE).mean(axis=1)
        softer = (stiffening_percents < -LEAST_INFLUENCE).mean(axis=1)
        effects_with_signs.append(replace(effect, stiffer=tuple(stiffer.tolist()), softer=tuple(softer.tolist())))
    return effects_with_signs
