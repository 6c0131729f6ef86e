"""The compliance of a machine by PyNite: a frame of straight members whose rigid parts are made ever stiffer.

The frame is built from points, axes and cross-sections. A joint or spring is a member along its axis: released or
compliant in torsion (revolute) or tension (slide) and stiff otherwise. Rigid parts have a finite stiffness here.
"""

import math
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from kinetostat.algebra.vector import Vector
from kinetostat.arrays import Array
from kinetostat.machine.leg import Joint, Leg, Spring
from kinetostat.machine.link import Beam, Parallelogram, Rigidity
from kinetostat.machine.machine import Configuration
from kinetostat.spec.errors import InputError
from kinetostat.tolerances import BLOCK_BEING_EXTRAPOLATED, SAME_NODE
from kinetostat.validation.comparison import Answer, Trial, difference
from kinetostat.validation.pieces import Piece, StrutPiece, array, columns, joint_of, pieces, section_axes

TRIALS = 10
"""Number of stiffnesses that are tried for rigid parts: enough to see where more of it only adds round-off."""
STIFFEST_TRIAL = 100.0
"""The greatest of these stiffnesses, in units of the stiffest part; the least is that of the softest part. The
compliance that rigid parts then have is taken away again by extrapolation, exactly so where no leg is redundant."""
LARGEST_CONTRAST = 1e7
"""Largest ratio of stiffnesses in one machine; beyond it a redundant stiff part can stay hidden from every trial."""
MOST_TRIALS_EXTRAPOLATED = 6
"""Most trials that one extrapolation uses: polynomials of higher degree amplify round-off."""
STUB_LENGTH = 0.4
"""Length of the member that represents a joint, as a share of the machine's: its own stiffness does not depend on it,
and members of like lengths keep the equations well conditioned."""
LOAD_NAMES = ("MX", "MY", "MZ", "FX", "FY", "FZ")
DISPLACEMENT_NAMES = ("RX", "RY", "RZ", "DX", "DY", "DZ")
"""Words of PyNite for loads on a node and for its displacements, in the order rx ry rz x y z."""


def solve(configuration: Configuration, reference: Vector) -> Answer:
    """Return C with rigid parts of several stiffnesses k, extrapolated to 1/k = 0.

    Args:
        configuration: the placed machine.
        reference: the point where loads act and motions are read, base frame, m.

    Raises:
        InputError: if it has a part that no member stands for, or stiffnesses too far apart.
    """
    length = float(configuration.length)
    softest, stiffest = _extremes(configuration)
    if stiffest > LARGEST_CONTRAST * softest:
        raise InputError(
            "Stiffnesses of this machine differ by more than seven decades, too much for PyNite, in which rigid parts "
            "must have a finite stiffness as well; use Exudyn."
        )
    stiffnesses = np.geomspace(softest, STIFFEST_TRIAL * stiffest, TRIALS).tolist()
    trials = [Trial(stiff, _compliance(configuration, reference, stiff)) for stiff in stiffnesses]
    best, second_best = extrapolate([1.0 / t.scale for t in trials], [t.compliance for t in trials], length)
    return Answer(best, second_best, "stiffness of rigid parts, N/m", tuple(trials))


def extrapolate(steps: Sequence[float], values: Sequence[Array], length: float) -> tuple[Array, Array]:
    """Extrapolate values [6 x 6] at ever smaller steps to step 0, by polynomials through consecutive ones (Neville).

    Returns:
        The value that differs least from its two neighbours of one degree less, and the neighbour that differs more.
    """
    least, best, second_best = math.inf, values[-1], values[-2]
    column = list(values)
    for degree in range(1, min(MOST_TRIALS_EXTRAPOLATED, len(steps))):
        finer = [
            (steps[i] * column[i + 1] - steps[i + degree] * column[i]) / (steps[i] - steps[i + degree])
            for i in range(len(column) - 1)
        ]
        for new, *older in zip(finer, column, column[1:], strict=False):
            gaps = [difference(old, new, length, BLOCK_BEING_EXTRAPOLATED) for old in older]
            if degree > 1 and max(gaps) < least:
                least, best, second_best = max(gaps), new, older[gaps.index(max(gaps))]
        column = finer
    return best, second_best


def _extremes(configuration: Configuration) -> tuple[float, float]:
    """Return the least and greatest stiffness of its parts, N/m; those in N·m/rad through the machine's length."""
    length = float(configuration.length)
    stiffnesses: list[float] = []
    for leg in configuration.legs:
        for piece in pieces(leg, configuration.plane):
            stiffnesses += _stiffnesses(piece, length)
    finite = [k for k in stiffnesses if 0.0 < k < math.inf]
    return (min(finite), max(finite)) if finite else (1.0, 1.0)


def _stiffnesses(piece: Piece, length: float) -> list[float]:
    """Return the stiffnesses of a piece, N/m, as `_extremes` compares them."""
    if isinstance(piece, Spring):
        return [float(piece.stiffness) / (1.0 if piece.joint.point is None else length**2)]
    if isinstance(piece, Beam):
        rigidity, size = piece.rigidity, section_axes(piece)[1]
        turning = [float(k) / (size * length**2) for k in (rigidity.torsion, rigidity.bending_y, rigidity.bending_z)]
        return [float(rigidity.axial) / size, *turning]
    if isinstance(piece, Joint):
        return []
    return [float(piece.stiffness if isinstance(piece, StrutPiece) else piece.bar)]


def _compliance(configuration: Configuration, reference: Vector, stiff: float) -> Array:
    """Return C at the reference, base axes, with a stiffness (N/m) of rigid parts."""
    plane = configuration.plane
    axes = np.eye(3) if plane is None else columns(plane.frame.rotation)
    frame = Frame(plane is not None, float(configuration.length), stiff)
    platform = frame.node(axes.T @ array(reference))
    for leg in configuration.legs:
        chain = pieces(leg, plane)
        _leg(frame, leg, chain, axes, platform)
    turn = np.kron(np.eye(2), axes)
    return np.asarray(turn @ frame.compliance(platform) @ turn.T)


class Frame:
    """A frame in PyNite, in axes in which a planar machine lies in the x-y plane.

    Attributes:
        model: the `FEModel3D`.
        planar: whether its nodes move in its x-y plane only.
        length: a characteristic length of the machine, m.
        stiffness: stiffness of rigid parts, N/m; converted to N·m/rad by the length.
        points: coordinates of each node, m.
    """

    def __init__(self, planar: bool, length: float, stiffness: float) -> None:
        self.model: Any = import_module("Pynite").FEModel3D()
        self.model.add_material("unit", 1.0, 1.0, 0.0, 0.0)
        self.planar, self.length, self.stiffness = planar, length, stiffness
        self.points: dict[str, Array] = {}

    def node(self, point: Array) -> str:
        """Add a node at a point (m); it is a separate body until a member reaches it."""
        name = f"N{len(self.points)}"
        self.model.add_node(name, *map(float, point))
        self.points[name] = point
        if self.planar:
            self.model.def_support(name, support_DZ=True, support_RX=True, support_RY=True)
        return name

    def fixed_node(self, point: Array) -> str:
        """Add a node that does not move."""
        name = self.node(point)
        self.model.def_support(name, *(True,) * 6)
        return name

    def reach(self, at: str, point: Array) -> str:
        """Return a node of the same body at a point: the given one if it lies there."""
        if self._are_apart(self.points[at], point):
            return self.rigid(at, self.node(point))
        return at

    def rigid(self, near: str, far: str) -> str:
        """Add a stiff member between two nodes, by a detour if they lie at one point; return the second node."""
        if not self._are_apart(self.points[near], self.points[far]):
            near = self.rigid(near, self.node(self.points[near] + np.array([STUB_LENGTH * self.length, 0.0, 0.0])))
        self.member((near, far), Rigidity())
        return far

    def _are_apart(self, a: Array, b: Array) -> bool:
        return float(np.linalg.norm(a - b)) > SAME_NODE * self.length

    def stub(self, at: str, axis: Array, slide: bool, stiffness: float | None = None) -> str:
        """Add a slide along an axis, or a turn about the line along it through a node: free, or with a spring.

        Returns:
            A node of the body after it.
        """
        size = STUB_LENGTH * self.length
        end = self.node(self.points[at] + size * axis)
        rigidity = Rigidity()
        if stiffness is not None:
            rigidity = Rigidity(axial=stiffness * size) if slide else Rigidity(torsion=stiffness * size)
        name = self.member((at, end), rigidity)
        if stiffness is None:
            self.model.def_releases(name, **{"Dxj" if slide else "Rxj": True})
        return end

    def member(self, ends: tuple[str, str], rigidity: Rigidity, axes: Array | None = None) -> str:
        """Add a member between two nodes; return its name.

        Args:
            ends: its nodes.
            rigidity: of its cross-section; what is infinite becomes as stiff as rigid parts.
            axes: axes of its cross-section as columns x y z; PyNite's choice if None.
        """
        section = (rigidity.axial, rigidity.bending_y, rigidity.bending_z, rigidity.torsion)
        rigid = (self.stiffness * self.length, *(self.stiffness * self.length**3,) * 3)
        entries = [r if math.isinf(k) else float(k) for k, r in zip(section, rigid, strict=True)]
        name = f"M{len(self.model.members)}"
        self.model.add_section(name, *entries)
        self.model.add_member(name, *ends, "unit", name)
        member = self.model.members[name]
        _keep_whole(member)
        if axes is not None:
            _turn(member, axes)
        return name

    def bar(self, near: str, far: str, stiffness: float) -> None:
        """Add a spring (N/m) between two nodes."""
        finite = self.stiffness if math.isinf(stiffness) else stiffness
        self.model.add_spring(f"S{len(self.model.springs)}", near, far, finite)

    def compliance(self, node: str) -> Array:
        """Return the displacements of a node under six unit loads on it, rx ry rz x y z, in frame axes [6 x 6]."""
        moving = (2, 3, 4) if self.planar else range(6)
        for i in moving:
            self.model.add_node_load(node, LOAD_NAMES[i], 1.0, case=LOAD_NAMES[i])
            self.model.add_load_combo(LOAD_NAMES[i], {LOAD_NAMES[i]: 1.0})
        # Loads act on nodes alone: PyNite would ask each member six times for the reactions to loads along it.
        self.model.FER = lambda _: np.zeros((len(DISPLACEMENT_NAMES) * len(self.model.nodes), 1))
        self.model.analyze_linear(check_stability=False)
        compliance = np.zeros((6, 6))
        for j in moving:
            compliance[:, j] = [getattr(self.model.nodes[node], name)[LOAD_NAMES[j]] for name in DISPLACEMENT_NAMES]
        return compliance


def _turn(member: Any, axes: Array) -> None:
    """Turn a member's cross-section about its axis until its y axis is that of `axes`, up to its sign."""
    y, z = (member.T()[i, :3] for i in (1, 2))
    angle = math.degrees(math.atan2(float(axes[:, 1] @ z), float(axes[:, 1] @ y)))
    for member.rotation in (-angle, angle):
        if abs(float(member.T()[1, :3] @ axes[:, 1])) > 1.0 - SAME_NODE:
            return


def _keep_whole(member: Any) -> None:
    """Keep PyNite from joining a member to every node that lies on it: bodies may touch there and yet be free."""
    split_at_nodes: Callable[[], None] = member.descritize

    def split_at_ends() -> None:
        model = member.model
        all_nodes, model.nodes = model.nodes, {node.name: node for node in (member.i_node, member.j_node)}
        try:
            split_at_nodes()
        finally:
            model.nodes = all_nodes

    member.descritize = split_at_ends


def _leg(frame: Frame, leg: Leg, chain: Sequence[Piece], axes: Array, platform: str) -> None:
    """Add the members of one leg from a fixed node to the platform's."""
    if not chain:
        raise InputError(
            f"{leg.name} is rigid and welds the platform to the base, which PyNite cannot represent; use Exudyn."
        )
    at = frame.fixed_node(frame.points[platform])
    for piece in chain:
        at = _piece(frame, piece, axes, at)
    frame.rigid(at, platform)


def _piece(frame: Frame, piece: Piece, axes: Array, at: str) -> str:
    """Add the members of a piece that begins on the body of node `at`; return a node of the body after it."""
    if isinstance(piece, Joint | Spring):
        return _joint(frame, piece, axes, at)
    if isinstance(piece, Beam):
        return _beam(frame, piece, axes, at)
    if isinstance(piece, StrutPiece):
        near, far = frame.reach(at, axes.T @ array(piece.start)), frame.node(axes.T @ array(piece.end))
        frame.bar(near, far, piece.stiffness)
        return far
    return _parallelogram(frame, piece, axes, at)


def _joint(frame: Frame, piece: Joint | Spring, axes: Array, at: str) -> str:
    joint = joint_of(piece)
    if joint.pitch != 0.0:
        raise InputError("PyNite's members have no release for a screw; use Exudyn for this machine.")
    if joint.point is not None:
        at = frame.reach(at, axes.T @ array(joint.point))
    stiffness = float(piece.stiffness) if isinstance(piece, Spring) else None
    return frame.stub(at, axes.T @ array(joint.axis), joint.point is None, stiffness)


def _beam(frame: Frame, beam: Beam, axes: Array, at: str) -> str:
    rigidity = beam.rigidity
    if math.isfinite(rigidity.shear_y) or math.isfinite(rigidity.shear_z):
        raise InputError(
            f'"{beam.name}" deflects in shear, which PyNite\'s members do not; use Exudyn for this machine.'
        )
    near, far = frame.reach(at, axes.T @ array(beam.start)), frame.node(axes.T @ array(beam.end))
    frame.member((near, far), rigidity, axes.T @ section_axes(beam)[0])
    return far


def _parallelogram(frame: Frame, piece: Parallelogram, axes: Array, at: str) -> str:
    """Add two bars between bodies; stubs for the motions in the parallelogram's plane keep them parallel to it."""
    near, far, side = (axes.T @ array(v) for v in (piece.near, piece.far, piece.side))
    along = (far - near) / np.linalg.norm(far - near)
    normal = np.cross(side, along)
    normal = normal / np.linalg.norm(normal)
    at = before = frame.reach(at, near)
    for axis, slide in ((along, True), (np.cross(normal, along), True), (normal, False)):
        at = frame.stub(at, axis, slide)
    after = frame.reach(at, far)
    for start, end in piece.bars:
        ends = frame.reach(before, axes.T @ array(start)), frame.reach(after, axes.T @ array(end))
        frame.bar(*ends, float(piece.bar))
    return after
