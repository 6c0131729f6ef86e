"""The first question: how stiff is this machine at this pose, and why. One pose; nothing is compiled.

What is printed or written of it is elsewhere (`analysis_data`, `views.tables`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinetostat.algebra.screw import COMPONENTS, Screw
from kinetostat.algebra.symmetric import Symmetric6
from kinetostat.algebra.vector import IDENTITY, Rotation
from kinetostat.kinematics.jacobian import actuator_jacobian
from kinetostat.kinematics.mobility import Mobility, mobility
from kinetostat.kinematics.singularity import conditioning, describe, independent
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.assembly import Statics, compliance_matrix, stiffness_matrix
from kinetostat.kinetostatics.attribution import compliance_shares, stiffness_shares
from kinetostat.kinetostatics.conditioning import twist_condition
from kinetostat.kinetostatics.internal import InternalLoads, internal_loads
from kinetostat.kinetostatics.response import Response, respond
from kinetostat.machine.leg import Spring
from kinetostat.machine.machine import Configuration, Machine, need_machine, springs
from kinetostat.machine.mass import Mass, moving_masses
from kinetostat.machine.parameters import parameters, values, with_values
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.indices import Along, Indices, indices_of, stiffness_along
from kinetostat.studies.loads import LoadCase, load_case
from kinetostat.studies.refusal import why_not
from kinetostat.studies.rounding import clean_matrix, clean_screw

Rows = list[list[float]]

AXES = ("base", "platform")
"""In which results are given."""
INDEPENDENT = 1e-9
"""Relative size of a singular value below which the motions of springs are dependent."""
NEARBY = 0.03
"""How far poses for the general mobility lie from the pose: in units of the machine's length, and in rad."""


@dataclass(frozen=True)
class SpringShare:
    """What one spring does to the platform.

    Attributes:
        name: of the spring.
        part: the joint or link that it stands for.
        stiffness: N/m or N·m/rad; infinity if rigid.
        compliance: its share of the diagonal entries of C, 0 to 1, or None where there is nothing to share.
        stiffness_share: likewise of K.
    """

    name: str
    part: str
    stiffness: float
    compliance: tuple[float | None, ...]
    stiffness_share: tuple[float | None, ...]


@dataclass(frozen=True)
class Analysis:
    """The answer at one pose; matrices at the tool point T (P itself unless there is a tool), SI.

    Attributes:
        machine: what was analysed.
        status: of the pose; all that follows is None or empty unless it is OK.
        message: one readable paragraph.
        components: names of the rows and columns of K and C: rx ry rz x y z, or rz x y of a planar machine.
        axes: "base" or "platform", in which everything is given.
        platform: position of P (m) and rotation (rows) in the base frame.
        stiffness: K [n x n], None where a direction is rigid (K has no finite value there).
        compliance: C [n x n], None where a direction is free.
        stiffness_diagonal, compliance_diagonal: their diagonals, infinity where rigid or free.
        rank: of C, or of K where a direction is free.
        rigid, free: names of the springs with infinite and with zero stiffness.
        shares: attribution, spring by spring.
        indices: numbers and directions read off K and C.
        mobility: what can move, and the kind of pose.
        internal: statically indeterminate loads.
        load: what the machine's [load] does, None without one.
        masses: of what moves, part by part.
        wrench_condition: ratio of the extreme singular values of W, moments divided by the characteristic length.
        jacobian_condition: of the actuators' Jacobian, angles multiplied by that length; None where actuators are of
            two kinds, or there is none.
        length: that length, m.
    """

    machine: Machine
    status: Status
    message: str
    components: tuple[str, ...] = COMPONENTS
    axes: str = "base"
    platform: tuple[tuple[float, ...], Rows] | None = None
    stiffness: Rows | None = None
    compliance: Rows | None = None
    stiffness_diagonal: tuple[float, ...] = ()
    compliance_diagonal: tuple[float, ...] = ()
    rank: int | None = None
    rigid: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    shares: tuple[SpringShare, ...] = ()
    indices: Indices | None = None
    mobility: Mobility | None = None
    internal: InternalLoads | None = None
    load: LoadCase | None = None
    masses: tuple[Mass, ...] = ()
    wrench_condition: float | None = None
    jacobian_condition: float | None = None
    length: float | None = None

    def __repr__(self) -> str:
        return f"<Analysis of {self.machine.name!r}: {self.status.word}, components {' '.join(self.components)}>"

    @property
    def mass(self) -> float | None:
        """Of what moves as far as it is known, kg; None where nothing is known."""
        known = [float(one.mass) for one in self.masses if one.mass is not None]
        return sum(known) if known else None

    def along(self, direction: Sequence[float]) -> Along:
        """Stiffness along and about a direction, in the axes of K and C.

        Raises:
            InputError: if the machine has no such direction, or the pose no answer.
        """
        if self.status is not Status.OK:
            raise InputError(f"There is no stiffness along any direction here. {self.message}")
        return stiffness_along(direction, self.stiffness, self.compliance, self.machine.family.components)


def analyze(machine: Machine, axes: str = "base") -> Analysis:
    """K, C, attribution, indices, mobility and loads of a machine at its pose.

    A pose that cannot be reached or is singular is an answer too: see `status` and `message`.

    Args:
        machine: with its pose, tool and load.
        axes: "base", or "platform" for results in platform axes.

    Raises:
        InputError: other axes, or no machine.
    """
    need_machine(machine)
    choice(axes, AXES, "axes")
    response = respond(machine)
    status = Status(int(response.status))
    configuration = response.configuration
    if status is not Status.OK:
        return Analysis(machine, status, why_not(machine, response, _around(machine)), machine.family.component_names)
    turn = IDENTITY if axes == "base" else configuration.platform.rotation.inverse()
    response = replace(response, statics=_without_rounding(response.statics))
    statics = _without_rounding(_turned(response.statics, turn))
    stiffness, compliance = stiffness_matrix(statics), compliance_matrix(statics)
    kept = machine.family.components
    soft, stiff = _rows(compliance, kept), _rows(stiffness, kept)
    held, length = springs(configuration), float(configuration.length)
    rigid = tuple(spring.name for spring in held if math.isinf(spring.stiffness))
    free = tuple(spring.name for spring in held if spring.stiffness == 0.0)
    extremes = conditioning(response.legs, length, response.guide)
    return Analysis(
        machine,
        status,
        _message(response, rigid, free, stiff is not None),
        components=machine.family.component_names,
        axes=axes,
        platform=_placement(configuration),
        stiffness=stiff,
        compliance=soft,
        stiffness_diagonal=tuple(stiffness.entry(i, i) for i in kept),
        compliance_diagonal=tuple(compliance.entry(i, i) for i in kept),
        rank=_rank(statics, soft is None),
        rigid=rigid,
        free=free,
        shares=_shares(held, statics, stiffness, compliance, kept),
        indices=indices_of(stiff, soft, length, kept),
        mobility=mobility(configuration, _around(machine), response.reference),
        internal=internal_loads([leg.name for leg in configuration.legs], response.legs, length, response.guide),
        load=load_case(machine, replace(response, compliance=compliance), turn),
        masses=tuple(moving_masses(machine, configuration)),
        wrench_condition=float(extremes[0] / extremes[-1]),
        jacobian_condition=_jacobian_condition(response, length),
        length=length,
    )


def _jacobian_condition(response: Response, length: float) -> float | None:
    """Of the actuators' Jacobian in the components that they move."""
    groups = [leg.springs for leg in response.configuration.legs]
    kinds = {s.joint.point is None for group in groups for s in group if s.actuated and float(s.stiffness) > 0.0}
    if len(kinds) != 1:
        return None
    return twist_condition(actuator_jacobian(response.legs, groups, length, response.guide), length)


def _rows(matrix: Symmetric6, kept: tuple[int, ...]) -> Rows | None:
    """The rows and columns that exist, without rounding, or None where an entry is infinite."""
    rows = [[float(matrix.entry(i, j)) for j in kept] for i in kept]
    return clean_matrix(rows) if all(math.isfinite(entry) for row in rows for entry in row) else None


def _placement(configuration: Configuration) -> tuple[tuple[float, ...], Rows]:
    turn = configuration.platform.rotation
    rows = zip(*([float(c) for c in axis.components()] for axis in (turn.x, turn.y, turn.z)), strict=True)
    return tuple(float(c) for c in configuration.platform.translation.components()), [list(row) for row in rows]


def _around(machine: Machine) -> list[Configuration]:
    """The machine at three poses around its own, as far as it can reach them."""
    pose = {p.path: p.quantity.kind for p in parameters(machine.family) if p.path.startswith("pose.")}
    length, held = float(machine_length(machine)), values(machine)
    found, rng = [], np.random.default_rng(0)
    for _ in range(3):
        reach = {path: NEARBY * (length if kind == "length" else 1.0) for path, kind in pose.items()}
        response = respond(with_values(machine, {p: held[p] + r * float(rng.uniform(-1, 1)) for p, r in reach.items()}))
        if Status(int(response.status)) is Status.OK:
            found.append(response.configuration)
    return found


def machine_length(machine: Machine) -> float:
    """The characteristic length of a machine at its pose, m."""
    return float(respond(machine).configuration.length)


def _turned(statics: Statics, turn: Rotation) -> Statics:
    """The shares of the springs, of K and of C in axes turned back by `turn`."""
    return replace(
        statics,
        flexibility=tuple(twist.rotated(turn) for twist in statics.flexibility),
        resistance=tuple(wrench.rotated(turn) for wrench in statics.resistance),
        motions=tuple((twist.rotated(turn), s) for twist, s in statics.motions),
        actions=tuple((wrench.rotated(turn), k) for wrench, k in statics.actions),
    )


def _without_rounding(statics: Statics) -> Statics:
    """The same statics with exact zeros where a screw's component is but rounding beside its others."""
    length = statics.length
    return replace(
        statics,
        flexibility=tuple(clean_screw(twist, 1.0 / length) for twist in statics.flexibility),
        resistance=tuple(clean_screw(wrench, length) for wrench in statics.resistance),
        motions=tuple((clean_screw(twist, 1.0 / length), s) for twist, s in statics.motions),
        actions=tuple((clean_screw(wrench, length), k) for wrench, k in statics.actions),
    )


def _rank(statics: Statics, endless: bool) -> int:
    """Rank of C, or of K where C is not finite; independent of how much the springs differ."""
    if endless:
        held: list[Screw] = [wrench for wrench, k in statics.actions if k > 0.0]
        return independent(held, statics.length, INDEPENDENT)
    moved: list[Screw] = [twist for twist, s in statics.motions if s > 0.0]
    return independent(moved, 1.0 / statics.length, INDEPENDENT)


def _message(response: Response, rigid: tuple[str, ...], free: tuple[str, ...], yielding: bool) -> str:
    sentences = []
    if not yielding and not rigid:
        sentences.append("A leg carries a load here that none of its springs feels: K is infinite against it, C exact.")
    if rigid:
        sentences.append(f"Rigid: {', '.join(rigid)}; K is infinite in the directions that they hold, C is exact.")
    held = springs(response.configuration)
    for spring, twist in zip(held, response.statics.flexibility, strict=True):
        if spring.name in free:
            per = "m" if spring.joint.point is None else "rad"
            motion = describe([float(c) for c in twist.components()], (f"rad/{per}", f"m/{per}"))
            moves = f"so that the platform moves freely by {motion}" if motion else "and carries nothing"
            sentences.append(f"Free: {spring.name} has no stiffness, {moves}.")
    return " ".join(sentences) or Status.OK.sentence


def _shares(
    held: list[Spring], statics: Statics, stiffness: Symmetric6, compliance: Symmetric6, kept: tuple[int, ...]
) -> tuple[SpringShare, ...]:
    parts = zip(compliance_shares(statics), stiffness_shares(statics), held, strict=True)
    return tuple(
        SpringShare(
            spring.name, spring.part or spring.name, spring.stiffness,
            _ratio(soft, compliance, kept), _ratio(stiff, stiffness, kept),
        )
        for soft, stiff, spring in parts
    )  # fmt: skip


def _ratio(part: Symmetric6, whole: Symmetric6, kept: tuple[int, ...]) -> tuple[float | None, ...]:
    pairs = [(part.entry(i, i), whole.entry(i, i)) for i in kept]
    return tuple(p / w if 0.0 < w < math.inf else None for p, w in pairs)
