"""Masses, time step, armature and damping of a machine in MuJoCo. Static deflections depend on none of them.

Accuracy and the time to come to rest do. MuJoCo's constraints are soft: a closed loop has a compliance of about
(1 - d) t² / m, with d at most 0.9999 and t at least two time steps. So the step follows from how large that compliance
may be compared with the machine's.

Source: MuJoCo documentation, Computation, section on the constraint model (impedance and reference acceleration).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinetostat.exchange.mjcf_model import Body, Freedom, Model
from kinetostat.exchange.results import reference_point
from kinetostat.machine.loads import PLATFORM, Mass
from kinetostat.studies.analysis import Analysis
from kinetostat.tolerances import RIGID_BLOCK, SOFT_CONSTRAINT
from kinetostat.validation.masses import Heavy

NOMINAL_MASS = 1.0
"""kg, of every body where no mass is known: deflections do not depend on it."""
GYRATION = 0.25
"""Radius of gyration of every body, as a share of the machine's characteristic length."""
IMPEDANCE = 0.9999
"""d: the stiffest constraint that MuJoCo allows."""
LEAST_STEPS = 2.0
"""Time constant of a constraint in time steps: the shortest that MuJoCo allows."""
DAMPING = 0.7
"""Damping ratio of the machine's slowest motion: it comes to rest after one swing."""
CALM = 2.0
"""How much longer than the geometric mean of step and damping time the period of a spring's armature is."""
UNKNOWN_COMPLIANCE = 1e-7
"""m/N, assumed where the machine is free or rigid, so that its compliance says nothing."""


@dataclass(frozen=True)
class Pace:
    """How fast the model moves.

    Attributes:
        step: time step, s.
        retardation: damping of a spring per its stiffness, s.
        settling: time after which a deflection has come to rest, s.
        inertias: mass, its centre and inertia of every body by name.
        armatures: inertia added to joints by name, kg or kg·m²; None if `armature` decides it.
        carried: further mass on the platform.
    """

    step: float
    retardation: float
    settling: float
    inertias: dict[str, Heavy]
    armatures: dict[str, float] | None = None
    carried: tuple[Heavy, ...] = ()

    def damping(self, stiffness: float) -> float:
        """Damping of a joint with a spring, N·s/m or N·m·s/rad."""
        return stiffness * self.retardation

    def armature(self, freedom: Freedom) -> float:
        """Inertia added to a joint with a spring, kg or kg·m², so that no spring is too fast for the time step."""
        if self.armatures is not None:
            return self.armatures.get(freedom.name, 0.0)
        return freedom.stiffness * CALM**2 * self.retardation * self.step


def pace_of(analysis: Analysis, model: Model) -> Pace:
    """Return a pace with accurate constraints, springs that the time step can follow, and little swinging."""
    masses = _masses(model, analysis.masses)
    length = float(analysis.characteristic_length or 1.0)
    gyration = GYRATION * length
    step = step_for(analysis, min(masses.values()), gyration)
    slowest = math.sqrt(max(compliances(analysis, length)) * sum(masses.values()))
    places = {body.name: body.at for body in model.world.every()}
    places[model.platform.name] = np.array(reference_point(analysis))  # so that loads on the platform act there
    inertias = {name: Heavy(mass, places[name], mass * gyration**2 * np.eye(3)) for name, mass in masses.items()}
    return Pace(step, 2.0 * DAMPING * slowest, 20.0 * slowest, inertias)


def step_for(analysis: Analysis, least: float, gyration: float) -> float:
    """Return the time step (s) with which constraints are stiff enough, for a least mass (kg) and its gyration (m)."""
    stiff = min(compliances(analysis, gyration))
    return math.sqrt(SOFT_CONSTRAINT * stiff * least / (1.0 - IMPEDANCE)) / LEAST_STEPS


def compliances(analysis: Analysis, arm: float) -> list[float]:
    """Return sizes of the compliant blocks of C, m/N; rotation as a point at an arm (m) moves under a force there."""
    if analysis.compliance is None:
        return [UNKNOWN_COMPLIANCE]
    matrix = np.array(analysis.compliance)
    turns = np.array([name.startswith("r") for name in analysis.components])
    moving, turning = (float(np.linalg.norm(matrix[np.ix_(block, block)])) for block in (~turns, turns))
    sizes = moving, turning * arm**2
    return [size for size in sizes if size > RIGID_BLOCK * max(sizes)] or [UNKNOWN_COMPLIANCE]


def _masses(model: Model, known: Sequence[Mass]) -> dict[str, float]:
    """Mass of every body, kg: known masses of a leg are spread evenly over its bodies, others get the mean of those."""
    bodies = [body for body in model.world.every() if body is not model.world]
    masses = {body.name: _share(body, bodies, known) for body in bodies}
    masses[model.platform.name] = sum(
        float(part.mass) for part in known if part.name == PLATFORM and part.mass is not None
    )
    weighed = [mass for mass in masses.values() if mass > 0.0]
    usual = sum(weighed) / len(weighed) if weighed else NOMINAL_MASS
    return {name: mass or usual for name, mass in masses.items()}


def _share(body: Body, bodies: Sequence[Body], known: Sequence[Mass]) -> float:
    masses = [float(p.mass) for p in known if p.mass is not None and p.leg == body.leg]
    return sum(masses) / sum(other.leg == body.leg for other in bodies)
