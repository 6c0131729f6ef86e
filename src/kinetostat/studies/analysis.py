"""Analysis of a machine at one pose: how stiff it is, and why. Its tables are in `views.analysis_tables`.

Numbers are computed directly, without the engine: compiling would take longer than a single pose does.

Some facts are known at a pose without an answer as well. At an actuation singularity the legs still resist: K is
finite, and singular. C is finite between the loads that do no work on the free twists and the motions that these leave
alone; its other entries are infinite.

Source: theory sections 2 and 5; for C of a singular pose, a pseudo-inverse of K in units of the characteristic length.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Screw
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import IDENTITY, Rotation
from kinetostat.arrays import Array
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.mobility import (
    Mobility,
    actuator_jacobian,
    columns,
    conditioning,
    count_independent,
    describe,
)
from kinetostat.kinematics.status import PLACELESS, Status
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, stiffness_matrix
from kinetostat.kinetostatics.indices import twist_condition
from kinetostat.kinetostatics.loading import InternalLoads, internal_loads
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.actuators import Actuator
from kinetostat.machine.limits import no_limits_sentence
from kinetostat.machine.loads import Mass, moving_masses
from kinetostat.machine.machine import Machine, springs
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.spec.renamed import former_names
from kinetostat.studies.analysis_parts import Indices, LoadCase, indices_of, load_case
from kinetostat.studies.attribution import Contribution, Softest, by_part, contributions, softest
from kinetostat.studies.cleaning import clean_matrix, clean_statics
from kinetostat.studies.directions import DirectionalStiffness, stiffness_along
from kinetostat.tolerances import (
    CLOSING_ROUND_OFF,
    FREE_COMPONENT,
    MOST_LEG_CONTRAST,
    ROUND_OFF_OF_ENTRY,
    SINGULAR,
)

if TYPE_CHECKING:
    import pandas as pd

    from kinetostat.studies.requirements import Verdict

AXES = ("base", "platform")
"""Axes in which results are given."""


@former_names(shares="attribution", internal="internal_loads", length="characteristic_length", mass="moving_mass")
@dataclass(frozen=True, eq=False)
class Analysis(AnswerInState):
    """Stiffness of a machine at one pose; matrices at the tool point T (P itself unless there is a tool), SI.

    Attributes:
        state: the machine at its pose, in the state that is meant.
        status: status of the pose. Unless it is OK, attribution, indices and loads are unknown, and the rest where the
            machine has no place; K and C are known at singular poses as far as they are finite.
        message: one paragraph on what is special about the pose, or on why it has no answer.
        components: names of the rows and columns of K and C: rx ry rz x y z, or rz x y of a planar machine.
        axes: "base" or "platform": the axes of K, C, the attribution, the indices and the load.
        platform: position of P, m, and rows of the rotation matrix of the platform, both in the base frame.
        stiffness: K [n x n], None where a direction is rigid (K has no finite value there).
        compliance: C [n x n], None where a direction is free.
        finite_compliance: C of a singular pose, with NaN in the entries that are not finite; None at others.
        stiffness_diagonal, compliance_diagonal: their diagonals [n], infinity where rigid or free; empty without an
            answer.
        rank: rank of C, or of K where a direction is free.
        rigid, free: names of the springs with infinite and with zero stiffness.
        attribution: contribution of each spring to K and C.
        indices: numbers and directions read off K and C.
        softest: the softest direction of "translation" and of "rotation", and what makes it soft.
        mobility: the motions that are free, and the kind of pose.
        internal_loads: statically indeterminate loads.
        load: effects of the machine's [load], None where it has none.
        masses: mass of each moving part.
        actuators: actuators with their coordinates: length of the leg, position, travel or angle; `forward` takes them.
        singularity_margin: singularity margin of the pose, theory section 2: the least of the next two.
        leg_singularity_margin, platform_singularity_margin: the least of any leg's passive joints, and that of the
            wrenches that hold the platform.
        wrench_condition: ratio of the extreme singular values of W, moments divided by the characteristic length.
        jacobian_condition: condition number of the actuators' Jacobian, angles multiplied by the characteristic length;
            None where some actuators are rotary and others linear, or where there is no actuator.
        characteristic_length: a length, m, that makes rotations comparable with translations.
        directions: stiffnesses along and about directions that were asked for.
        requirements: verdicts on the requirements of the machine's file, where they were asked for.
    """

    state: MachineState
    status: Status
    message: str
    components: tuple[str, ...] = COMPONENTS
    axes: str = "base"
    platform: tuple[Array, Array] | None = None
    stiffness: Array | None = None
    compliance: Array | None = None
    finite_compliance: Array | None = None
    stiffness_diagonal: Array = field(default_factory=lambda: np.zeros(0))
    compliance_diagonal: Array = field(default_factory=lambda: np.zeros(0))
    rank: int | None = None
    rigid: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    attribution: tuple[Contribution, ...] = ()
    indices: Indices | None = None
    softest: Mapping[str, Softest] = field(default_factory=dict)
    mobility: Mobility | None = None
    internal_loads: InternalLoads | None = None
    load: LoadCase | None = None
    masses: tuple[Mass, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    singularity_margin: float | None = None
    leg_singularity_margin: float | None = None
    platform_singularity_margin: float | None = None
    wrench_condition: float | None = None
    jacobian_condition: float | None = None
    characteristic_length: float | None = None
    directions: tuple[DirectionalStiffness, ...] = ()
    requirements: "tuple[Verdict, ...]" = ()

    def __repr__(self) -> str:
        return f"<Analysis of {self.machine.name!r}: {self.status.word}, components {' '.join(self.components)}>"

    @property
    def moving_mass(self) -> float | None:
        """Mass of all moving parts whose mass is known, kg; None where none is known."""
        masses = [float(part.mass) for part in self.masses if part.mass is not None]
        return sum(masses) if masses else None

    @property
    def K(self) -> Array:  # noqa: N802
        """Stiffness at T [n x n], SI; rows and columns as in `components`.

        Raises:
            InputError: it is not finite here, or the pose has no answer.
        """
        return self._matrix("K", self.stiffness)

    @property
    def C(self) -> Array:  # noqa: N802
        """Compliance at T [n x n], SI; rows and columns as in `components`.

        Raises:
            InputError: it is not finite here, or the pose has no answer.
        """
        return self._matrix("C", self.compliance)

    def _matrix(self, name: str, rows: Array | None) -> Array:
        if rows is None:
            raise InputError(f"{name} has no finite value at this pose. {self.message}")
        return rows

    @checked
    def shares_of(self, component: str, matrix: str = "C") -> dict[str, float]:
        """Shares of the joints and links in one diagonal entry of C or K by name, the greatest first; their sum is 1.

        Args:
            component: one of `components`.
            matrix: "C" or "K".

        Raises:
            InputError: there is no such component, or its entry is zero or infinite and cannot be shared.
        """
        row = self.components.index(choice(component, self.components, "component"))
        pick = attrgetter({"C": "compliance_share", "K": "stiffness_share"}[choice(matrix, ("C", "K"), "matrix")])
        parts = by_part(self.attribution).items()
        shares_by_part = {part: [pick(spring)[row] for spring in members] for part, members in parts}
        if not shares_by_part or np.isnan([*shares_by_part.values()]).any():
            raise InputError(f"{matrix}_{component} is zero or infinite here and has no shares. {self.message}")
        return dict(
            sorted(((part, float(sum(shares))) for part, shares in shares_by_part.items()), key=lambda pair: -pair[1])
        )

    @checked
    def to_pandas(self, which: str = "attribution") -> "pd.DataFrame":
        """Return a table of pandas, SI.

        Args:
            which: "attribution" (a row for each spring: its part, its stiffness, its shares C_x ... and K_x ... in the
                diagonal entries), "K" or "C".

        Raises:
            InputError: there is no such table, or the matrix is not finite here.
        """
        import pandas as pd  # takes long to load, which an analysis alone need not wait for

        if choice(which, ("attribution", "K", "C"), "which") != "attribution":
            return pd.DataFrame(getattr(self, which), list(self.components), list(self.components))
        rows = [
            [spring.part, spring.stiffness, *spring.compliance_share, *spring.stiffness_share]
            for spring in self.attribution
        ]
        shares = [f"{matrix}_{component}" for matrix in "CK" for component in self.components]
        names = pd.Index([spring.spring for spring in self.attribution], name="spring")
        return pd.DataFrame(rows, names, ["part", "stiffness", *shares])

    @checked
    def along(self, direction: Sequence[float]) -> DirectionalStiffness:
        """Stiffness along and about a direction, in the axes of K and C.

        Raises:
            InputError: if the machine has no such direction, or the pose has no answer.
        """
        if self.status is not Status.OK:
            raise InputError(f"There is no stiffness along any direction here. {self.message}")
        return stiffness_along(direction, self.stiffness, self.compliance, self.machine.family.components)


@checked
def analyze(machine: Machine | MachineState, axes: str = "base") -> Analysis:
    """Analyse a machine at its pose: K, C, attribution, indices, mobility and loads.

    A pose that is singular or cannot be reached raises no error: `status` and `message` say what is the case.

    Args:
        machine: the machine, with its pose, tool and load; or its state, as `state_of` returns it.
        axes: "base", or "platform" for results in platform axes.

    Raises:
        InputError: if `axes` is neither "base" nor "platform", or `machine` is not a machine.
    """
    choice(axes, AXES, "axes")
    state = state_of(machine)
    turn = IDENTITY if axes == "base" else state.configuration.platform.rotation.inverse()
    unanswered = Analysis(
        state=state,
        status=state.status,
        message=state.refusal,
        components=state.machine.family.component_names,
        axes=axes,
    )
    if state.status is not Status.OK:
        return _without_answer(unanswered, turn)
    return _with_answer(unanswered, turn)


def _with_answer(analysis: Analysis, turn: Rotation) -> Analysis:
    """Return an analysis with all that is known at a pose with an answer; `turn` leads from base axes to its own."""
    state, components = analysis.state, analysis.machine.family.components
    response, configuration = state.response, state.configuration
    # Screws are cleaned before they are turned, where an exact zero is easy to tell, and once more after it, because
    # turning adds round-off of its own.
    response = replace(response, statics=clean_statics(response.statics))
    statics = clean_statics(_turned_statics(response.statics, turn))
    stiffness, compliance = stiffness_matrix(statics), compliance_matrix(statics)
    stiffness_rows, compliance_rows = _rows(stiffness, components), _rows(compliance, components)
    all_springs, length = springs(configuration), float(configuration.length)
    extremes = conditioning(response.legs, length, response.guide)
    indices = indices_of(stiffness_rows, compliance_rows, length, components)
    weakest = {name: softest(block, name, all_springs, statics) for name, block in (indices.free or {}).items()}
    answer = replace(
        _with_place(analysis),
        stiffness=stiffness_rows,
        compliance=compliance_rows,
        stiffness_diagonal=np.array([float(stiffness.entry(i, i)) for i in components]),
        compliance_diagonal=np.array([float(compliance.entry(i, i)) for i in components]),
        rank=_rank(response, statics, compliance_rows is None),
        attribution=contributions(all_springs, statics, stiffness, compliance, components),
        indices=indices,
        softest={name: direction for name, direction in weakest.items() if direction is not None},
        mobility=state.mobility,
        internal_loads=internal_loads([leg.name for leg in configuration.legs], response.legs, length, response.guide),
        load=load_case(response, statics, turn, components),
        wrench_condition=float(extremes[0] / extremes[-1]),
        jacobian_condition=_jacobian_condition(response, length),
    )
    return replace(answer, message=_message(answer, response.statics))


def _with_place(analysis: Analysis) -> Analysis:
    """Return an analysis with the fields that are known wherever a machine has a place, answer or not."""
    state = analysis.state
    response, configuration = state.free, state.free.configuration
    all_springs, rotation = springs(configuration), configuration.platform.rotation
    axes = [axis.components() for axis in (rotation.x, rotation.y, rotation.z)]
    position = configuration.platform.translation.components()
    return replace(
        analysis,
        platform=(np.array(position, dtype=float), np.array(axes, dtype=float).T),
        rigid=tuple(spring.name for spring in all_springs if math.isinf(spring.stiffness)),
        free=tuple(spring.name for spring in all_springs if spring.stiffness == 0.0),
        masses=tuple(moving_masses(state.machine, configuration)),
        actuators=tuple(replace(a, coordinate=float(a.coordinate)) for a in stand(state.machine, state.joints)),
        singularity_margin=float(response.singularity_margin),
        leg_singularity_margin=min((float(leg.singularity_margin) for leg in response.legs), default=1.0),
        platform_singularity_margin=float(response.statics.singularity_margin),
        characteristic_length=float(configuration.length),
    )


def _without_answer(analysis: Analysis, turn: Rotation) -> Analysis:
    """Return an analysis with what is known at a pose without an answer; nothing more where the machine has no place.

    `turn` leads from base axes to those of K and C.
    """
    state = analysis.state
    if Status(int(state.free.joint_status)) is not Status.OK or state.status in PLACELESS:
        return analysis
    placed = _with_place(analysis)
    if state.status is not Status.SINGULAR:
        return placed
    return _with_singular_matrices(replace(placed, mobility=state.mobility), turn)


def _with_singular_matrices(analysis: Analysis, turn: Rotation) -> Analysis:
    """Return an analysis with K and C of a singular pose, NaN for entries of C that are not finite.

    Where K is not finite either, the analysis stays as it is.
    """
    state = analysis.state
    length, components = float(state.free.configuration.length), list(state.machine.family.components)
    whole = _stiffness_by_legs(state.free, turn, length)
    if whole is None:
        return analysis
    units = np.repeat([1.0 / length, 1.0], 3)[components]
    scaled = units[:, None] * whole[np.ix_(components, components)] * units
    scaled[np.abs(scaled) < ROUND_OFF_OF_ENTRY * np.abs(scaled).max()] = 0.0
    values, vectors = np.linalg.eigh(scaled)
    # Eigenvalues of K grow with the square of the singular values of the wrenches, to which SINGULAR refers.
    resisted = values > SINGULAR**2 * values[-1]
    free = np.abs(vectors[:, ~resisted]).max(axis=1, initial=0.0) > FREE_COMPONENT
    compliance = units[:, None] * ((vectors[:, resisted] / values[resisted]) @ vectors[:, resisted].T) * units
    compliance[free, :] = compliance[:, free] = math.nan
    stiffness = scaled / units[:, None] / units
    return replace(
        analysis,
        stiffness=stiffness,
        stiffness_diagonal=np.diag(stiffness),
        finite_compliance=np.array(clean_matrix(compliance.tolist())),
        compliance_diagonal=np.where(free, math.inf, np.diag(compliance)),
        rank=int(resisted.sum()),
    )


def _stiffness_by_legs(response: Response, turn: Rotation, length: float) -> Array | None:
    """Add up K [6 x 6] over the legs as W G^-1 W^T, theory (3); None where a leg is rigid, free or locked."""
    whole = np.zeros((6, 6))
    for leg in response.legs:
        compliance = np.array(leg.compliance, dtype=float)
        if not (float(leg.singularity_margin) > SINGULAR and np.isfinite(compliance).all()):
            return None
        wrenches = np.array([w.turned_by(turn).components() for w in leg.wrenches], dtype=float).reshape(-1, 6).T
        loads = np.array(leg.loads, dtype=float).reshape(len(compliance), -1)
        if not (np.isfinite(wrenches).all() and np.isfinite(loads).all()):
            return None
        # Wrenches of one size, so that a leg with a long and a short one is not taken for an ill-conditioned one.
        sizes = np.linalg.norm(wrenches * np.repeat([1.0 / length, 1.0], 3)[:, None], axis=0)
        flexibility = (loads / sizes).T @ (compliance[:, None] * (loads / sizes))
        if wrenches.shape[1] and np.linalg.cond(flexibility) > MOST_LEG_CONTRAST:
            return None
        whole += (wrenches / sizes) @ np.linalg.solve(flexibility, (wrenches / sizes).T)
    return whole


def _jacobian_condition(response: Response, length: float) -> float | None:
    """Return the condition number of the actuators' Jacobian in the components that the actuators move, or None.

    Rows of rotary actuators are in rad and those of linear ones in m. Their ratio means nothing, so that machines with
    both kinds have no such number.
    """
    groups = [leg.springs for leg in response.configuration.legs]
    # A joint without a point is a translation.
    kinds = {s.joint.point is None for group in groups for s in group if s.actuated and float(s.stiffness) > 0.0}
    if len(kinds) != 1:
        return None
    return twist_condition(actuator_jacobian(response.legs, groups, length, response.guide), length)


def _rows(matrix: Symmetric6, components: tuple[int, ...]) -> Array | None:
    """Return the rows and columns of the machine's components, without round-off, or None if an entry is not finite."""
    rows = [[float(matrix.entry(i, j)) for j in components] for i in components]
    return np.array(clean_matrix(rows)) if np.isfinite(rows).all() else None


def _turned_statics(statics: Statics, turn: Rotation) -> Statics:
    """Return the statics with `turn` applied to every screw from which K, C and their attribution are computed."""
    return replace(
        statics,
        flexibility=tuple(twist.turned_by(turn) for twist in statics.flexibility),
        resistance=tuple(wrench.turned_by(turn) for wrench in statics.resistance),
        motions=tuple((twist.turned_by(turn), s) for twist, s in statics.motions),
        actions=tuple((wrench.turned_by(turn), k) for wrench, k in statics.actions),
    )


def _rank(response: Response, statics: Statics, compliance_infinite: bool) -> int:
    """Return the rank of C, or of K where C is not finite.

    The rank of a sum over springs is the number of their independent screws. They are counted at the size that they may
    have, so that a spring that is much softer than another cannot hide it, and round-off does not count.
    """
    length = float(statics.length)
    if compliance_infinite:
        wrenches: list[Screw] = [wrench for wrench, k in statics.actions if k > 0.0]
        return count_independent(wrenches, length, CLOSING_ROUND_OFF)
    # A twist of `flexibility` is at most the load that a unit wrench can exert on the spring (theory (7)), times the
    # share of it that the leg carries, which the norm of all shares bounds: one that is small beside that is round-off.
    greatest_loads = [math.sqrt(square) for leg in response.legs for square in leg.load_squares]
    bound_of_shares = np.linalg.norm(columns([twist for leg in statics.sharing for twist in leg], 1.0, 1.0 / length))
    flexible = zip(statics.flexibility, statics.compliance, greatest_loads, strict=True)
    twists = [twist * (1.0 / (load * bound_of_shares)) for twist, s, load in flexible if s > 0.0]
    if not twists:
        return 0
    return int((np.linalg.svd(columns(twists, 1.0, 1.0 / length), compute_uv=False) > CLOSING_ROUND_OFF).sum())


def _message(analysis: Analysis, statics: Statics) -> str:
    """Say what is special about a pose that has been analysed, of whose statics round-off is cleaned; base axes."""
    sentences, state = [], analysis.state
    k_is_finite = analysis.stiffness is not None
    if not k_is_finite and not analysis.rigid:
        sentences.append("At this pose a leg is rigid against some load: K is infinite against it, and C is exact.")
    if analysis.rigid:
        if k_is_finite:
            consequence = "other parts deflect in the same directions, so that K is finite"
        else:
            consequence = "K is infinite in the directions that they hold, C is exact"
        sentences.append(f"Rigid: {', '.join(analysis.rigid)}; {consequence}.")
    for spring, twist in zip(springs(state.configuration), statics.flexibility, strict=True):
        if spring.name in analysis.free:
            per = "m" if spring.joint.point is None else "rad"
            motion = describe([float(c) for c in twist.components()], (f"rad/{per}", f"m/{per}"))
            moves = f"so that the platform moves freely by {motion}" if motion else "and carries nothing"
            sentences.append(f"Free: {spring.name} has no stiffness, {moves}.")
    if analysis.load and analysis.load.unheld:
        sentences.append(analysis.load.unheld)
    sentences = sentences or [Status.OK.sentence]
    more = (state.left_out, no_limits_sentence(state.machine.tables["limits"]))
    return " ".join([*sentences, *(sentence for sentence in more if sentence)])
