"""The equations of motion of a machine in operator form, for users who go on: M(x), C(x, v), g(x), forces of drives.

Parts are rigid: springs stand still, joints and drives move (theory section 20). What a whole motion asks of the drives
is the study `drives`; nothing here is about time.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kinetostat.arrays import Array
from kinetostat.engine.moving import RigidForm, rigid_form
from kinetostat.equilibrium.state import MachineState, state_of, states_at
from kinetostat.frozen import dataclass
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinematics.status import PLACELESS
from kinetostat.kinetostatics.drive_limits import driven_springs
from kinetostat.machine.actuators import actuators_of, joint_actuators, name_of, senses_of
from kinetostat.machine.column import stacked_columns
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import POSE, values
from kinetostat.motion.forces import PARTS, drive_forces
from kinetostat.motion.machine_at_pose import MachineAtPose, Operators, forces_along, operators
from kinetostat.motion.rates import PoseRates
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.immutable import ImmutableAnswer


@dataclass(frozen=True, eq=False)
class Dynamics(ImmutableAnswer):
    """The equations of motion M(x) x'' + C(x, x') x' + g(x) = J^T f of a machine at its pose, SI.

    Over the pose, x are its coordinates in the order of `coordinates` (m and rad); over the drives, x are those of the
    drives in the order of `drives` (m of slides, rad of turns), and J is 1. Friction and loads of the file are not in
    M, C and g, but in `forces`.

    Attributes:
        state: the state of the machine at its pose.
        form: the form of its equations: all that does not depend on the pose.
        coordinates: names of the coordinates of the pose.
        drives: names of the drives.
    """

    state: MachineState
    form: RigidForm
    coordinates: tuple[str, ...]
    drives: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Equations of motion of {self.state.machine.name!r}: {len(self.drives)} drives>"

    def at(self, **pose: float) -> "Dynamics":
        """The same machine at another pose, m and rad; telescopic legs keep their masses."""
        there = self.state.machine.with_values({f"{POSE}{name}": value for name, value in pose.items()})
        return _dynamics(MachineState(there), self.form)

    @cached_property
    def _at_pose(self) -> MachineAtPose:
        return self.form.at(self.state)

    @cached_property
    def _at_rest(self) -> Operators:
        return operators(self._at_pose, dict.fromkeys(self.coordinates, 0.0))

    @cached_property
    def senses(self) -> Array:
        """1 where the coordinate of a drive grows as its joint moves forward, else -1 [drives]."""
        return senses_of_drives(self.state)

    @property
    def mass(self) -> Array:
        """M over the pose [coordinates x coordinates]: kg of lengths, kg·m² of angles."""
        return np.array(self._at_rest.mass, dtype=float)

    @property
    def gravity(self) -> Array:
        """g over the pose, what holds the weight [coordinates]: N of lengths, N·m of angles."""
        return np.array(self._at_rest.gravity, dtype=float)

    @property
    def jacobian(self) -> Array:
        """J: speeds of the drives by the rates of the pose's coordinates [drives x coordinates]."""
        return np.array(self._at_rest.drive_rates, dtype=float) * self.senses[:, None]

    @checked
    def coriolis(self, rates: Sequence[float]) -> Array:
        """C over the pose at some rates of its coordinates [coordinates x coordinates]; dM/dt - 2 C is skew-symmetric.

        Args:
            rates: rates of the coordinates in their order, m/s and rad/s.
        """
        return np.array(operators(self._at_pose, self._by_name(rates)).coriolis, dtype=float)

    @property
    def mass_at_drives(self) -> Array:
        """M over the drives [drives x drives]: kg of slides, kg·m² of turns.

        Raises:
            InputError: there are more drives than coordinates, so that these cannot move one by one.
        """
        return self._over_drives([0.0] * len(self.coordinates)).mass

    @property
    def gravity_at_drives(self) -> Array:
        """g over the drives [drives]: N of slides, N·m of turns; errors as of `mass_at_drives`."""
        return self._over_drives([0.0] * len(self.coordinates)).gravity

    @checked
    def coriolis_at_drives(self, speeds: Sequence[float]) -> Array:
        """C over the drives at some speeds of theirs [drives x drives]; errors as of `mass_at_drives`.

        Args:
            speeds: speeds of the drives in their order, m/s and rad/s.
        """
        self._check_square()
        return self._over_drives(np.linalg.solve(self.jacobian, np.asarray(speeds, dtype=float)).tolist()).coriolis

    @checked
    def forces(self, rates: Sequence[float], accelerations: Sequence[float]) -> dict[str, Array]:
        """Forces of the drives by part, N of slides and N·m of turns [drives], positive where their coordinates grow.

        The parts are what holds the weight, accelerates masses and rotors, holds the loads of the file, overcomes
        friction, and bends flexure hinges; their sum is what a drive does.

        Args:
            rates: rates of the coordinates in their order, m/s and rad/s.
            accelerations: their accelerations, m/s² and rad/s².
        """
        at_pose = self._at_pose
        _, demand_by_part = forces_along(at_pose, PoseRates(self._by_name(rates), self._by_name(accelerations)))
        length = float(at_pose.rigid.length)
        units = self.senses * [1.0 if drive.slides else length for drive in at_pose.rigid.drives]
        return {
            part: np.array(drive_forces(at_pose.rigid, at_pose.statics, demand_by_part[part]), dtype=float) * units
            for part in PARTS
        }

    def _by_name(self, numbers: Sequence[float]) -> dict[str, float]:
        row = [float(number) for number in numbers]
        if len(row) != len(self.coordinates):
            raise InputError(
                f"There are {len(row)} numbers; give one for each coordinate of the pose: "
                f"{', '.join(self.coordinates)}."
            )
        return dict(zip(self.coordinates, row, strict=True))

    def _check_square(self) -> None:
        if len(self.drives) != len(self.coordinates):
            raise InputError(
                f"{self.state.machine.name} has {len(self.drives)} drives and {len(self.coordinates)} coordinates, so "
                "that its drives cannot move one by one; ask for M, C and g over the pose."
            )

    def _over_drives(self, rates: Sequence[float]) -> "_DriveEquations":
        """M, C and g over the drives, at some rates of the coordinates of the pose."""
        self._check_square()
        mass, coriolis, gravity = operators(self._at_pose, self._by_name(rates)).at_drives()
        signs = np.outer(self.senses, self.senses)
        return _DriveEquations(
            mass=np.array(mass, dtype=float) * signs,
            coriolis=np.array(coriolis, dtype=float) * signs,
            gravity=np.array(gravity, dtype=float) * self.senses,
        )


class _DriveEquations(NamedTuple):
    """M and C [drives x drives] and g [drives] over the coordinates of the drives."""

    mass: Array
    coriolis: Array
    gravity: Array


def places_of_drives(state: MachineState) -> list[int]:
    """Places of the drives among all actuators of a machine, of which some may be free and drive nothing."""
    actuators = [spring for leg in state.configuration.legs for spring in leg.springs if spring.actuated]
    driven = driven_springs(state.configuration)
    return [place for place, spring in enumerate(actuators) if any(spring is drive for drive in driven)]


def senses_of_drives(state: MachineState) -> Array:
    """1 where the coordinate of a drive grows as its joint moves forward, else -1 [drives], at a single pose."""
    if state.machine.family.chains is None:
        senses = np.array(senses_of(state.configuration), dtype=float)
    else:
        senses = np.array([a.sign for a in joint_actuators(state.machine.chains(), leg_names(state.machine))])
    return np.asarray(senses[places_of_drives(state)])


def coordinates_of_drives(state: MachineState, columns: Mapping[str, Array], count: int) -> Array:
    """Coordinates of the drives of a machine at n poses, m or rad [drives x n]; those of turns go on after a turn.

    Args:
        state: the state of the machine at its own pose.
        columns: values of the parameters that vary, by leaf path, SI [n].
        count: number of poses, n.
    """
    machine = state.machine
    with np.errstate(all="ignore"):  # poses without a place
        states = states_at(machine, columns, count)
        if states.joints is None:
            actuators = actuators_of(states.configuration)
        else:
            actuators = [a.at(states.joints.coordinates) for a in joint_actuators(machine.chains(), leg_names(machine))]
        rows = stacked_columns([actuators[place].coordinate for place in places_of_drives(state)], count).T
    slides = np.array([spring.joint.point is None for spring in driven_springs(state.configuration)])
    return np.where(slides[:, None], rows, np.unwrap(rows, axis=1))


@checked
def dynamics(machine: Machine | MachineState) -> Dynamics:
    """Take the equations of motion of a machine of rigid parts at its pose.

    Args:
        machine: the machine with its masses: those of platform, payload, links and rotors.

    Raises:
        InputError: the machine has no place at its pose, or its drives do not hold all of its motions.
    """
    state = state_of(machine)
    return _dynamics(state, rigid_form_of(state))


def rigid_form_of(state: MachineState) -> RigidForm:
    """The form of the equations of a machine, where it can be moved by its drives.

    Raises:
        InputError: the machine has no place at its pose, or its drives do not hold all of its motions.
    """
    if int(state.free.status) in PLACELESS:
        raise InputError(f"{state.machine.name} has no place at this pose: {state.refusal}")
    form = rigid_form(state)
    motions, drives = 6 - len(form.plan.independent), len(driven_springs(state.configuration))
    coordinates = sum(path.startswith(POSE) for path in values(state.machine))
    if drives < motions or coordinates != motions:
        raise InputError(
            f"{state.machine.name} has {drives} drives for {motions} motions of its platform at this pose, and "
            f"its pose has {coordinates} coordinates; drives must hold as many motions as the pose has coordinates: "
            "actuate further joints, or take a pose that is not singular."
        )
    return form


def _dynamics(state: MachineState, form: RigidForm) -> Dynamics:
    coordinates = tuple(p.removeprefix(POSE) for p in values(state.machine) if p.startswith(POSE))
    drives = tuple(name_of(spring) for spring in driven_springs(state.configuration))
    return Dynamics(state, form, coordinates, drives)
