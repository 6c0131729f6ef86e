"""Rigid bodies in Exudyn and connections between two of them: exact constraints, 6x6 springs, bars. No machine here.

Every body's frame is the base frame moved to a point, so that all rotations are zero where the machine is unloaded.
"""

import math
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.machine.leg import Joint
from kinetostat.validation.pieces import array

TRANSLATION_FIRST = [3, 4, 5, 0, 1, 2]
"""Places of Exudyn's x y z rx ry rz in kinetostat's rx ry rz x y z, and the other way round."""


@dataclass(frozen=True)
class EngineBody:
    """A body and the place of its frame.

    Attributes:
        number: number of the body in the engine.
        node: number of the node with its coordinates; None for the ground.
        origin: origin of its frame, base frame, m.
    """

    number: int
    node: int | None
    origin: Array


class Multibody:
    """A system of bodies in Exudyn, with forces measured in a chosen unit.

    Attributes:
        engine: the imported package.
        items: its module of classes for nodes, bodies, markers and connectors.
        container: what owns the system, which would be gone without it.
        system: its `MainSystem`.
        ground: the base.
        unit: force in N that is 1 in the engine: with the greatest stiffness near 1 its solver distinguishes small
            numbers that matter from round-off.
        preloaded: whether springs carry their preloads.
        chains: bodies of each leg from the base to the platform.
    """

    def __init__(self, unit: float = 1.0, preloaded: bool = False) -> None:
        self.engine = import_module("exudyn")
        self.engine.config.suppressWarnings = True  # it prints advice, which would stand in the JSON of a large machine
        self.items: Any = import_module("exudyn.itemInterface")
        self.container = self.engine.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = EngineBody(self.system.CreateGround(), None, np.zeros(3))
        self.unit, self.preloaded = unit, preloaded
        self.chains: list[list[EngineBody]] = []

    def add_body(self, origin: Array) -> EngineBody:
        """Add a body without mass with its frame at a point (m)."""
        node = int(self.system.AddNode(self.items.NodeRigidBodyRxyz(referenceCoordinates=[*origin, 0.0, 0.0, 0.0])))
        return EngineBody(self._add_rigid(node, 0.0, np.zeros(3), np.zeros((3, 3))), node, origin)

    def add_mass(self, body: EngineBody, mass: float, centre: Array, inertia: Array) -> None:
        """Add a mass (kg) to a body, with its centre at a point (m) and its inertia about it (kg·m² [3 x 3])."""
        if body.node is not None:
            self._add_rigid(body.node, mass, centre - body.origin, inertia)

    def _add_rigid(self, node: int, mass: float, arm: Array, inertia: Array) -> int:
        """Add a rigid body on a node, which several may share, with its centre of mass at an arm (m)."""
        about_node = (inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))) / self.unit
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = about_node
        return int(
            self.system.AddObject(
                self.items.ObjectRigidBody(
                    nodeNumber=node, mass=mass / self.unit, inertia=[xx, yy, zz, yz, xz, xy], centerOfMass=list(arm)
                )
            )
        )

    def add_rod(self, bodies: Sequence[EngineBody], ends: Sequence[Array], mass: float) -> None:
        """Add the mass (kg) of a straight uniform rod between points of two bodies (m); its length may change.

        The velocity of its points is interpolated between those of its ends, so that its kinetic energy is
        m/6 (v1² + v1·v2 + v2²). Its ends are nodes of an element with that matrix of mass, exactly at the points of the
        bodies, however these are placed.
        """
        nodes = [self.system.AddNode(self.items.NodePoint(referenceCoordinates=list(end))) for end in ends]
        matrix = np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3)) * (mass / 6.0 / self.unit)
        self._add_mass_matrix(nodes, np.asarray(matrix, dtype=float))
        for body, end, node in zip(bodies, ends, nodes, strict=True):
            place = self.items.MarkerBodyPosition(bodyNumber=body.number, localPosition=end - body.origin)
            markers = (self.items.MarkerNodePosition(nodeNumber=node), place)
            numbers = [self.system.AddMarker(marker) for marker in markers]
            self.system.AddObject(self.items.SphericalJoint(markerNumbers=numbers))

    def add_rotor(self, bodies: Sequence[EngineBody], joint: Joint, inertia: float) -> None:
        """Add a rotor that turns with the motion between two unloaded bodies.

        It is an element with a matrix of mass over the coordinates of both bodies, at the place where they were built.

        Args:
            bodies: the near and the far body.
            joint: the motion between them.
            inertia: inertia of the rotor as this motion feels it, kg of a slide or kg·m² of a turn.
        """
        rates, nodes, axis = [], [], array(joint.axis)
        for body, sign in zip(bodies, (-1.0, 1.0), strict=True):
            if body.node is not None:
                if joint.point is None:
                    rate = [axis, np.cross(bodies[0].origin - body.origin, axis)]
                else:
                    rate = [np.zeros(3), axis]
                rates.append(sign * np.concatenate(rate))
                nodes.append(body.node)
        row = np.concatenate(rates)
        self._add_mass_matrix(nodes, np.outer(row, row) * (inertia / self.unit))

    def _add_mass_matrix(self, nodes: Sequence[int], matrix: Array) -> None:
        """Add an element that has nothing but a matrix of mass over the coordinates of nodes."""
        zeros = np.zeros_like(matrix)
        self.system.AddObject(
            self.items.ObjectGenericODE2(
                nodeNumbers=nodes, massMatrix=matrix, stiffnessMatrix=zeros, dampingMatrix=zeros
            )
        )

    def add_marker(self, body: EngineBody, point: Array, axes: Array) -> int:
        """Add a frame on a body, at a point (m) with the given axes as columns (base frame)."""
        place = self.engine.HT(rotation=axes, translation=point - body.origin)
        return int(self.system.AddMarker(self.items.MarkerBodyRigid(bodyNumber=body.number, localHT=place)))

    def couple(
        self,
        bodies: Sequence[EngineBody],
        frame: tuple[Array, Array],
        constrained: Sequence[bool],
        stiffness: Array | None = None,
        preload: Array | None = None,
    ) -> None:
        """Constrain some of rx ry rz x y z between two bodies exactly, and let springs act on the others.

        Args:
            bodies: the near and the far body.
            frame: point (m) and axes (columns) of the six components, base frame.
            constrained: whether each of these is constrained.
            stiffness: stiffness of the springs, N·m/rad, N/rad, N/m [6 x 6]; diagonal if there is a preload.
            preload: preload of the springs, N·m and N [6]; only springs with a stiffness carry one.
        """
        markers = [self.add_marker(body, *frame) for body in bodies]
        if any(constrained):
            axes = [int(constrained[i]) for i in TRANSLATION_FIRST]
            self.system.AddObject(self.items.GenericJoint(markerNumbers=markers, constrainedAxes=axes))
        if stiffness is not None:
            matrix = stiffness[np.ix_(TRANSLATION_FIRST, TRANSLATION_FIRST)] / self.unit
            spring = self.items.RigidBodySpringDamper(markerNumbers=markers, stiffness=matrix)
            if self.preloaded and preload is not None:
                divisors = np.where(np.diag(stiffness) > 0.0, np.diag(stiffness), 1.0)
                spring.offset = (-preload / divisors)[TRANSLATION_FIRST].tolist()  # it carries K (u - offset)
            self.system.AddObject(spring)

    def add_bar(
        self, bodies: Sequence[EngineBody], ends: Sequence[Array], stiffness: float, preload: float = 0.0
    ) -> None:
        """Add a spring (N/m) between a point of the near and one of the far body (m), or a bar of constant length."""
        markers = [self.add_marker(body, end, np.eye(3)) for body, end in zip(bodies, ends, strict=True)]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        if math.isinf(stiffness):
            bar = self.items.DistanceConstraint(markerNumbers=markers, distance=length)
        else:
            bar = self.items.SpringDamper(
                markerNumbers=markers,
                referenceLength=length,
                stiffness=stiffness / self.unit,
                force=preload / self.unit if self.preloaded else 0.0,
            )
        self.system.AddObject(bar)

    def add_thread(self, bodies: Sequence[EngineBody], line: tuple[Array, Array], pitch: float) -> None:
        """Couple the slide along a line (point in m, direction) to the turn about it: `pitch` m per rad."""
        point, axis = line
        markers, rows, offsets = [], [], []
        for body in bodies:
            node = self.system.AddNode(self.items.NodePointGround()) if body.node is None else body.node
            markers.append(self.system.AddMarker(self.items.MarkerNodeCoordinates(nodeNumber=node)))
            row = np.concatenate([axis, np.cross(point - body.origin, axis) - pitch * axis])
            rows.append(np.zeros((1, 0)) if body.node is None else row[None, :])
            offsets.append(0.0 if body.node is None else float(axis @ body.origin))
        self.system.AddObject(
            self.items.CoordinateVectorConstraint(
                markerNumbers=markers,
                scalingMarker0=rows[0],
                scalingMarker1=rows[1],
                offset=[offsets[1] - offsets[0]],  # the engine counts coordinates from the origin, not from rest
            )
        )
