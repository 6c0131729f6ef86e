"""Machines in motion by a second route: positions of masses and drives, placed pose by pose, and differences of them.

It knows no screws: kinetic and potential energy come from the ends of links, and forces from virtual work along the
coordinates of the pose. Further, what must hold of any such equations: power, skew symmetry, statics, programs.
"""

import numpy as np
import pytest

from kinetostat.engine.moving import PosePath, forces_on_path, rigid_form
from kinetostat.equilibrium.state import actuator_loads_at_rest, state_of
from kinetostat.kinematics.forward import leg_names
from kinetostat.kinetostatics.drive_limits import driven_springs
from kinetostat.machine.actuators import actuators_of, joint_actuators
from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.loads import gravity_of, located_members
from kinetostat.machine.parameters import POSE, parameters, values, with_values
from kinetostat.motion.machine_at_pose import forces_along
from kinetostat.motion.rates import PoseRates
from kinetostat.studies.dynamics import dynamics

MASSES = ("tool.mass=3 kg", "tool.inertia=[0.02, 0.03, 0.04, 0.001, 0, 0.002]")
ROTORS = ("drives.rotor_inertia=1e-4", "drives.lead=10 mm", "drives.ratio=5")
FIRST = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
SECOND = np.array([2, -27, 270, -490, 270, -27, 2]) / 180.0
STEP = 4e-3
NAMES = ("hexapod", "delta", "planar-3rrr", "zhang-gosselin-4dof", "tripteron", "passive-leg-5dof-rus", "tricept")


def massive(name, *further):
    plain = load(name)
    links = [f"{p.path}=2 kg/m" for p in parameters(plain.family) if p.path.startswith("linear_density.")]
    flat = plain.family.planar
    centre = "tool.centre_of_mass=[0.02, 0.01, 0]" if flat else "tool.centre_of_mass=[0.02, 0.01, 0.03]"
    down = "load.gravity=[1, 2, 0]" if flat else "load.gravity=[1, 2, -9.81]"
    return load(name, [*MASSES, *ROTORS, *links, centre, down, *further])


def named(machine):
    names = [path.removeprefix(POSE) for path in values(machine) if path.startswith(POSE)]
    return names, np.array([float(values(machine)[POSE + name]) for name in names])


class Placed:
    """Where masses and drives of a machine are at a pose; masses of links are those at its own pose."""

    def __init__(self, machine):
        self.machine, self.names = machine, named(machine)[0]
        self.masses = [float(link.mass) for link in self.members(state_of(machine))]
        tool = machine.tables["tool"]
        self.tool = float(tool.mass)
        xx, yy, zz, xy, xz, yz = tool.inertia
        self.inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def members(self, state):
        return located_members(state.machine, state.configuration, state.joints and state.joints.coordinates)

    def at(self, numbers):
        """Points (three of each link, whose masses are 1/6, 2/3, 1/6), the platform's centre, its turn, the drives."""
        pose = dict(zip([POSE + name for name in self.names], map(float, numbers), strict=True))
        state = state_of(with_values(self.machine, pose))
        points = []
        for link in self.members(state):
            start, end = (np.array(p.components(), dtype=float) for _, p in link.ends())
            points += [start, 0.5 * (start + end), end]
        platform = state.configuration.platform
        centre = platform.apply(type(platform.translation)(*self.machine.tables["tool"].centre_of_mass))
        points.append(np.array(centre.components(), dtype=float))
        axes = (platform.rotation.x, platform.rotation.y, platform.rotation.z)
        turn = np.array([axis.components() for axis in axes], dtype=float).T
        if state.joints is None:
            every = actuators_of(state.configuration)
            springs = [s for leg in state.configuration.legs for s in leg.springs if s.actuated]
            every = [a for a, s in zip(every, springs, strict=True) if s in driven_springs(state.configuration)]
        else:
            chains = state.machine.chains()
            every = [a.at(state.joints.coordinates) for a in joint_actuators(chains, leg_names(state.machine))]
        return np.array(points), turn, np.array([float(a.coordinate) for a in every]), [a.slides for a in every]

    @property
    def weights(self):
        return np.array([*(m * share for m in self.masses for share in (1 / 6, 2 / 3, 1 / 6)), self.tool])

    def along(self, pose, rates, accelerations=0.0):
        steps = STEP * np.arange(-3, 4)
        rows = [self.at(pose + rates * t + 0.5 * accelerations * t * t) for t in steps]
        return [np.array([row[k] for row in rows]) for k in range(3)]


def spin(turns, turn):
    """Angular velocity and acceleration from seven rotations in a row."""
    turning = np.einsum("k,kij->ij", FIRST / STEP, turns) @ turn.T
    changing = np.einsum("k,kij->ij", SECOND / STEP**2, turns) @ turn.T - turning @ turning
    return [np.array([m[2, 1], m[0, 2], m[1, 0]]) for m in (turning, changing)]


def forces_by_differences(machine, rates, accelerations):
    """Forces of the drives from virtual work over differences of positions."""
    placed = Placed(machine)
    _, pose = named(machine)
    _, turn, _, slides = placed.at(pose)
    points, turns, drives = placed.along(pose, rates, accelerations)
    gained = np.einsum("k,kij->ij", SECOND / STEP**2, points)
    gained = gained - np.array(gravity_of(machine.tables["load"]).components(), dtype=float)
    turning, changing = spin(turns, turn)
    tensor = turn @ placed.inertia @ turn.T
    torque = tensor @ changing + np.cross(turning, tensor @ turning)
    rotors = machine.tables["drives"]
    reflected = [rotors.rotor_inertia * (2 * np.pi / rotors.lead if s else rotors.ratio) ** 2 for s in slides]
    speeded = np.einsum("k,ki->i", SECOND / STEP**2, drives) * reflected
    asked, moved = [], []
    for direction in np.eye(len(pose)):
        here, turned, driven = placed.along(pose, direction)
        rate = np.einsum("k,kij->ij", FIRST / STEP, here)
        moved.append(np.einsum("k,ki->i", FIRST / STEP, driven))
        work = (placed.weights[:, None] * gained * rate).sum() + torque @ spin(turned, turn)[0]
        asked.append(work + speeded @ moved[-1])
    return np.linalg.solve(np.array(moved), np.array(asked))


@pytest.mark.parametrize("name", NAMES)
def test_drives_do_what_virtual_work_asks_for(name):
    machine, rng = massive(name), np.random.default_rng(4)
    size = len(named(machine)[0])
    rates, accelerations = rng.normal(0.0, 0.1, size), rng.normal(0.0, 1.0, size)
    parts = dynamics(machine).forces(rates.tolist(), accelerations.tolist())
    expected = forces_by_differences(machine, rates, accelerations)
    assert parts["weight"] + parts["inertia"] == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def circle(machine, count, share=1.0):
    """A closed motion through all coordinates of the pose, once round in a second."""
    names, here = named(machine)
    time = np.arange(count) / count
    rng = np.random.default_rng(5)
    pose, rates, accelerations = {}, {}, {}
    for name, middle in zip(names, here, strict=True):
        size, turns, phase = 0.01 * share, 2.0 * np.pi * rng.integers(1, 3), rng.uniform(0.0, 6.0)
        angle = turns * time + phase
        pose[name], rates[name] = middle + size * np.sin(angle), size * turns * np.cos(angle)
        accelerations[name] = -size * turns**2 * np.sin(angle)
    return PosePath(pose, rates, accelerations)


def losses(machine, form, path, point):
    """The power that rotors and joints turn into heat at a point of a motion, from the rates of every joint, W."""
    pose = {POSE + name: float(column[point]) for name, column in path.pose.items()}
    here = form.at(state_of(with_values(machine, pose)))
    direction = [{n: float(c[point]) for n, c in part.items()} for part in (path.rates, path.accelerations)]
    lost = 0.0
    for leg, moving in zip(here.rigid.legs, here.along(PoseRates(*direction)).legs, strict=True):
        driven = [here.rigid.drives[number] for number in leg.drives]
        dampers = [*(part.viscous for part in leg.friction), *(drive.viscous for drive in driven)]
        rubs = [*(part.coulomb for part in leg.friction), *(drive.coulomb + drive.guide_friction for drive in driven)]
        for rate, damper, rub in zip(moving.rates, dampers, rubs, strict=True):
            lost += float(damper) * float(rate) ** 2 + float(rub) * abs(float(rate))
    return lost * float(here.rigid.length)


@pytest.mark.parametrize("name", NAMES)
def test_drives_get_back_all_that_friction_does_not_take(name):
    """The mean of a smooth periodic function over equal steps has no error but round-off.

    So drives do no work for weight and inertia once round, and all the rest is lost in joints and rotors.
    """
    rubs = ("drives.guide_friction=2 N", "drives.bearing_friction=0.1 N*m", "drives.rotor_friction=0.01 N*m")
    machine = massive(name, "drives.rotor_damping=1e-4 N*m*s/rad", "damping.hinges=0.02 N*m*s/rad", *rubs)
    form, path = rigid_form(state_of(machine)), circle(machine, 256)
    whole = forces_on_path(form, path)
    speed, _, weight, inertia, process, friction, springs = np.moveaxis(whole.drives, 1, 0)
    power = (speed * (weight + inertia)).sum(axis=0)
    assert abs(power.mean()) < 1e-10 * np.abs(power).max()
    taken = (speed * friction).sum(axis=0)
    for point in range(0, 256, 37):
        assert taken[point] == pytest.approx(losses(machine, form, path, point), rel=1e-10)
    assert not process.any()
    assert not springs.any()


@pytest.mark.parametrize("name", NAMES)
def test_change_of_mass_less_twice_coriolis_is_skew(name):
    """To the rounding of differences of M, which the step keeps above their error."""
    machine, rng, step = massive(name), np.random.default_rng(6), 1.5e-3
    names, pose = named(machine)
    equations, rates = dynamics(machine), rng.normal(0.0, 0.1, len(names))
    steps = [equations.at(**dict(zip(names, pose + step * k * rates, strict=True))) for k in range(-3, 4)]
    changed = np.einsum("k,kij->ij", FIRST / step, np.array([there.mass for there in steps]))
    both = 2.0 * equations.coriolis(rates.tolist())
    assert changed == pytest.approx(0.5 * (both + both.T), abs=1e-11 * np.abs(both).max())
    assert equations.mass == pytest.approx(equations.mass.T, abs=1e-15 * np.abs(equations.mass).max())


def forces_joint_by_joint(machine, rates, gains):
    """Forces of the drives by the equilibrium of every joint; what platform and legs exchange is unknown.

    It knows the wrenches that masses and loads ask for. No leg is solved for its rates, and no virtual work is done.
    """
    state, equations = state_of(machine), dynamics(machine)
    here = rigid_form(state).at(state)
    direction = [dict(zip(here.names, map(float, row), strict=True)) for row in (rates, gains)]
    demands = forces_along(here, PoseRates(*direction))[1].values()
    legs, drives = here.rigid.legs, here.rigid.drives
    size = 6 * len(legs) + len(drives)
    rows, right = [], []
    for number, leg in enumerate(legs):
        for place in range(leg.passive + len(leg.drives)):
            row, asked = np.zeros(size), sum(demand.legs[number][place] for demand in demands)
            for screw, coordinate in zip(leg.screws, leg.coordinates, strict=True):
                if coordinate == place:
                    row[6 * number : 6 * number + 6] += np.array(screw.components(), dtype=float)
            if place >= leg.passive:
                row[6 * len(legs) + leg.drives[place - leg.passive]] = 1.0
            rows.append(row)
            right.append(float(asked))
    for component in range(6):
        rows.append([1.0 if k < 6 * len(legs) and k % 6 == component else 0.0 for k in range(size)])
        right.append(-sum(float(demand.platform.components()[component]) for demand in demands))
    solved, *_ = np.linalg.lstsq(np.array(rows), np.array(right), rcond=1e-12)
    assert np.abs(np.array(rows) @ solved - right).max() < 1e-10 * np.abs(right).max()
    units = [1.0 if drive.slides else float(here.rigid.length) for drive in drives]
    return solved[6 * len(legs) :] * units * equations.senses


def has_a_drive_for_each_motion(name):
    machine = load(name)
    return len(driven_springs(state_of(machine).configuration)) == len(named(machine)[0])


DRIVEN_ONCE = [name for name in sorted(bundled()) if has_a_drive_for_each_motion(name)]


def test_these_machines_have_a_drive_for_each_motion():
    """One that lost a drive by mistake would else leave the test below in silence."""
    assert {*NAMES, "hexapod-hardware", "orthoglide"} <= set(DRIVEN_ONCE)
    assert "cogiro" not in DRIVEN_ONCE


@pytest.mark.parametrize("name", DRIVEN_ONCE)
def test_virtual_work_and_joint_by_joint_give_the_same_forces(name):
    """Where there are more drives, springs share a load among them.

    Friction of joints is viscous: a strut that may spin between two balls finds its own way under Coulomb's.
    """
    machine = massive(name, "drives.rotor_friction=0.05 N*m", "damping.hinges=0.02 N*m*s/rad")
    rates, gains = np.random.default_rng(9).normal(0.0, [[0.1], [1.0]], (2, len(named(machine)[0])))
    forces = sum(dynamics(machine).forces(rates.tolist(), gains.tolist()).values())
    assert forces == pytest.approx(forces_joint_by_joint(machine, rates, gains), abs=1e-11 * np.abs(forces).max())


@pytest.mark.parametrize("name", ["hexapod", "delta", "planar-3rrr", "zhang-gosselin-4dof", "tripteron"])
def test_operators_over_pose_and_drives_give_the_forces(name):
    machine, rng = massive(name), np.random.default_rng(7)
    equations = dynamics(machine)
    rates, gains = rng.normal(0.0, 0.1, (2, len(equations.coordinates)))
    parts = equations.forces(rates.tolist(), gains.tolist())
    forces = parts["weight"] + parts["inertia"]
    over_pose = equations.mass @ gains + equations.coriolis(rates.tolist()) @ rates + equations.gravity
    close = 1e-10 * np.abs(forces).max()
    assert equations.jacobian.T @ forces == pytest.approx(over_pose, abs=close)
    whole = forces_on_path(rigid_form(state_of(machine)), single(machine, rates, gains))
    speeds, accelerations = whole.drives[:, 0, 0] * equations.senses, whole.drives[:, 1, 0] * equations.senses
    turned = equations.coriolis_at_drives(speeds.tolist()) @ speeds
    over_drives = equations.mass_at_drives @ accelerations + turned + equations.gravity_at_drives
    assert over_drives == pytest.approx(forces, abs=close)


def single(machine, rates, gains):
    names, pose = named(machine)
    return PosePath(*({n: np.array([v]) for n, v in zip(names, row, strict=True)} for row in (pose, rates, gains)))


@pytest.mark.parametrize("name", [*(name for name in NAMES if name != "tripteron"), "hexapod-rus"])
def test_drives_hold_at_rest_what_the_loaded_machine_of_rigid_parts_shows(name):
    """As `analyze --loaded` finds them, positive where actuators are pulled."""
    flat = load(name).family.planar
    process = ["load.force=[30, -20, 0]", "load.moment=[0, 0, 3]"] if flat else ["load.force=[30, -20, 50]"]
    machine = massive(name, *process)
    stiff = [path for path, k in values(machine).items() if path.startswith("stiffness.") and k > 0.0]
    machine = with_values(machine, dict.fromkeys(stiff, np.inf))
    shown = [float(load[0]) for _, load in actuator_loads_at_rest(state_of(machine).at_rest)]
    still, equations = [0.0] * len(named(machine)[0]), dynamics(machine)
    forces = -equations.senses * sum(equations.forces(still, still).values())
    assert forces == pytest.approx(np.array(shown), abs=1e-12 * np.abs(shown).max())


STAGE = """
schema = 1
name   = "Stage on a flexure"
family = "legs"
[platform]
point = [0, 0, 0]
[pose]
x = "2 mm"
[tool]
mass = "2 kg"
[[legs]]
name = "flexure"
joints = [{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], stiffness = ["left 2 N/um", "right 2 N/um"] }]
[[legs]]
name = "drive"
joints = [{ name = "slide", type = "prismatic", joins = ["base", "platform"], point = [0, 0, 0], axis = [1, 0, 0], stiffness = "3 N/um", actuated = true }]
"""  # noqa: E501


def test_a_drive_bends_flexure_hinges_as_by_hand():
    """1 N/um times 2 mm, and 2 kg times 3 m/s²."""
    parts = dynamics(build(STAGE)).forces([0.0], [3.0])
    assert parts["springs"] == pytest.approx([2000.0])
    assert parts["inertia"] == pytest.approx([6.0])


def test_more_drives_than_motions_share_by_the_least_energy_of_their_springs():
    """Any other forces with the same virtual work store more energy: their differences do no work with these / k."""
    machine = load("cogiro")
    equations = dynamics(machine)
    rng = np.random.default_rng(8)
    rates, gains = rng.normal(0.0, 0.1, (2, 6))
    forces = sum(equations.forces(rates.tolist(), gains.tolist()).values())
    work = equations.mass @ gains + equations.coriolis(rates.tolist()) @ rates + equations.gravity
    assert equations.jacobian.T @ forces == pytest.approx(work, abs=1e-9 * np.abs(forces).max())
    stiffness = np.array([float(spring.stiffness) for spring in driven_springs(equations.state.configuration)])
    _, _, rows = np.linalg.svd(equations.jacobian.T)
    assert rows[6:] @ (forces / stiffness) == pytest.approx(0.0, abs=1e-9 * np.abs(forces / stiffness).max())


@pytest.mark.parametrize("name", ["hexapod", "zhang-gosselin-4dof", "tripteron"])
def test_machine_code_does_as_columns_do(name):
    machine = massive(name, "drives.rotor_friction=0.05 N*m", "damping.hinge_friction=0.1 N*m")
    form, path = rigid_form(state_of(machine)), circle(machine, 40, share=0.5)
    columns, program = (forces_on_path(form, path, joints=True, compiled=way) for way in (False, True))
    for name_ in ("drives", "joints", "inertia"):
        expected = getattr(columns, name_)
        assert getattr(program, name_) == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())


def test_every_bundled_machine_moves():
    for name in bundled():
        machine = massive(name)
        equations = dynamics(machine)
        assert np.linalg.eigvalsh(equations.mass).min() > 0.0
        assert len(equations.drives) >= len(equations.coordinates)
