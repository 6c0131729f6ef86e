"""Cable machines at rest, by the energy of their cables and of their weight: an independent second answer."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from grown_legs import rotation
from scipy.optimize import minimize

from kinetostat.arrays import Array

Document = dict[str, Any]

BALANCED = 1e-6
"""Share of the loads that may be left over."""


class Energy:
    """Of a platform on cables that only pull, over a displacement: rotation vector (rad), displacement of P (m)."""

    def __init__(self, document: Document, placement: tuple[Array, Array]) -> None:
        tool, load = document["tool"], document["load"]
        position, turn = placement
        self.position, self.anchors = position, np.array([leg["from"] for leg in document["legs"]])
        self.eyes = np.array([turn @ (np.array(leg["to"]) - document["platform"]["point"]) for leg in document["legs"]])
        self.stiffness = np.array([leg["stiffness"] for leg in document["legs"]])
        self.preloads = np.array([leg["preload"] for leg in document["legs"]])
        self.lengths = np.linalg.norm(position + self.eyes - self.anchors, axis=1)
        self.forces = [(turn @ tool["offset"], np.array(load["force"]))]
        self.forces += [(turn @ tool["centre_of_mass"], tool["mass"] * np.array(load["gravity"]))]
        self.size = float(sum(np.linalg.norm(force) for _, force in self.forces) + self.preloads.sum())

    def __call__(self, displacement: Sequence[float]) -> tuple[float, Array]:
        """The energy, J, and its slopes by the displacement."""
        vector, shift = np.array(displacement[:3]), np.array(displacement[3:])
        turn = _turn(vector)
        arms = self.eyes @ turn.T
        along = self.position + shift + arms - self.anchors
        lengths = np.linalg.norm(along, axis=1)
        tensions = np.maximum(self.preloads + self.stiffness * (lengths - self.lengths), 0.0)
        pulls = along * (tensions / lengths)[:, None]
        moved = [(turn @ arm, force) for arm, force in self.forces]
        work = sum(float(force @ (shift + arm)) for arm, force in moved)
        energy = float((tensions**2 / (2.0 * self.stiffness)).sum()) - work
        force = pulls.sum(axis=0) - sum(force for _, force in moved)
        moment = np.cross(arms, pulls).sum(axis=0) - sum(np.cross(arm, force) for arm, force in moved)
        return energy, np.concatenate([_turning(vector).T @ moment, force])

    def left_over(self, displacement: Array) -> float:
        """What the cables leave of the loads, as a share of them."""
        return float(np.linalg.norm(self(displacement)[1])) / self.size

    def descended(self) -> tuple[Array, float]:
        """Where a descent from the pose ends, and what is left of the loads there."""
        end = minimize(self, np.zeros(6), jac=True, method="BFGS", options={"gtol": 1e-10 * self.size, "maxiter": 2000})
        return end.x, self.left_over(end.x)


def _turn(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    return rotation(vector, angle) if angle > 0.0 else np.eye(3)


def _turning(vector: Array) -> Array:
    """Small rotation in base axes per change of a rotation vector [3 x 3]."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-4:
        return np.eye(3)
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    first, second = (1.0 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.eye(3) + first * cross + second * cross @ cross


def platform_displacement(document: Document, placement: tuple[Array, Array], displacement: Sequence[float]) -> Array:
    """The displacement of P from that of the tool point: rotation vector (rad), then displacement (m) [6]."""
    vector = np.array(displacement[:3])
    arm = placement[1] @ document["tool"]["offset"]
    return np.concatenate([vector, np.array(displacement[3:]) - (_turn(vector) @ arm - arm)])
