"""Members of a PyNite frame that represent rigid parts, joints, springs and beams. Knows no machine.

A joint or spring is a member along its axis: released or compliant in torsion (revolute) or tension (slide) and stiff
otherwise. Rigid parts have a finite stiffness here.
"""

import math
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.tolerances import SAME_NODE

STUB = 0.4
"""Length of the member that represents a joint, as a share of the machine's."""
LOADS = ("MX", "MY", "MZ", "FX", "FY", "FZ")
DISPLACEMENTS = ("RX", "RY", "RZ", "DX", "DY", "DZ")


class Frame:
    """A frame in PyNite, in axes in which a planar machine lies in the x-y plane.

    Attributes:
        model: the `FEModel3D`.
        planar: whether its nodes move in its x-y plane only.
        length: of the machine, m.
        stiff: stiffness of rigid parts, N/m; converted to N·m/rad by the length.
        points: coordinates of each node, m.
    """

    def __init__(self, planar: bool, length: float, stiff: float) -> None:
        self.model: Any = import_module("Pynite").FEModel3D()
        self.model.add_material("unit", 1.0, 1.0, 0.0, 0.0)
        self.planar, self.length, self.stiff = planar, length, stiff
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
        if self._apart(self.points[at], point):
            return self.rigid(at, self.node(point))
        return at

    def rigid(self, near: str, far: str) -> str:
        """Add a stiff member between two nodes, by a detour if they lie at one point; return the second node."""
        if not self._apart(self.points[near], self.points[far]):
            near = self.rigid(near, self.node(self.points[near] + np.array([STUB * self.length, 0.0, 0.0])))
        self.member((near, far), [math.inf] * 4)
        return far

    def _apart(self, a: Array, b: Array) -> bool:
        return float(np.linalg.norm(a - b)) > SAME_NODE * self.length

    def stub(self, at: str, axis: Array, slide: bool, stiffness: float | None = None) -> str:
        """Add a slide along an axis, or a turn about the line along it through a node: free, or with a spring.

        Returns:
            A node of the body after it.
        """
        size = STUB * self.length
        end = self.node(self.points[at] + size * axis)
        section = [math.inf] * 4
        if stiffness is not None:
            section[0 if slide else 3] = stiffness * size
        name = self.member((at, end), section)
        if stiffness is None:
            self.model.def_releases(name, **{"Dxj" if slide else "Rxj": True})
        return end

    def member(self, ends: tuple[str, str], section: Sequence[float], axes: Array | None = None) -> str:
        """Add a member between two nodes; return its name.

        Args:
            ends: its nodes.
            section: E A (N), E I about y and z, G J (N·m²); infinite ones become as stiff as rigid parts.
            axes: of its cross-section as columns x y z; PyNite's choice if None.
        """
        stiff = [self.stiff * self.length, *[self.stiff * self.length**3] * 3]
        name = f"M{len(self.model.members)}"
        self.model.add_section(name, *(s if math.isinf(k) else k for k, s in zip(section, stiff, strict=True)))
        self.model.add_member(name, *ends, "unit", name)
        member = self.model.members[name]
        _keep_whole(member)
        if axes is not None:
            _turn(member, axes)
        return name

    def bar(self, near: str, far: str, stiffness: float) -> None:
        """Add a spring (N/m) between two nodes."""
        self.model.add_spring(
            f"S{len(self.model.springs)}", near, far, self.stiff if math.isinf(stiffness) else stiffness
        )

    def compliance(self, node: str) -> Array:
        """Return the displacements of a node under six unit loads on it, rx ry rz x y z, in frame axes [6 x 6]."""
        moving = (2, 3, 4) if self.planar else range(6)
        for i in moving:
            self.model.add_node_load(node, LOADS[i], 1.0, case=LOADS[i])
            self.model.add_load_combo(LOADS[i], {LOADS[i]: 1.0})
        self.model.analyze_linear(check_stability=False)
        compliance = np.zeros((6, 6))
        for j in moving:
            compliance[:, j] = [getattr(self.model.nodes[node], what)[LOADS[j]] for what in DISPLACEMENTS]
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
    split: Callable[[], None] = member.descritize

    def alone() -> None:
        model = member.model
        everything, model.nodes = model.nodes, {node.name: node for node in (member.i_node, member.j_node)}
        try:
            split()
        finally:
            model.nodes = everything

    member.descritize = alone
