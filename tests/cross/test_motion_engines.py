"""Forces of drives along motions, against MuJoCo's mass matrix, bias forces and closing constraints.

MuJoCo is given the exported model of the machine at each pose. Its constraints are soft only while it steps through
time; here it is asked for its matrices alone, and the linear equations are solved with its constraints as they are.
"""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from kinetostat.equilibrium.state import state_of
from kinetostat.exchange.mjcf import text_of
from kinetostat.exchange.mjcf_model import build
from kinetostat.exchange.mjcf_pace import LIGHT_SHARE
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import POSE, parameters, values, with_values
from kinetostat.studies.analysis import analyze
from kinetostat.studies.dynamics import dynamics
from kinetostat.validation.pieces import rotor_inertia
from telescopes import telescopes

AGREED = 1e-8
"""Of the largest force; the largest found is 3e-11: what differences of the platform's placement leave."""
MASSES = (
    "tool.mass=3 kg",
    "tool.inertia=[0.02, 0.03, 0.04, 0.001, 0, 0.002]",
    "tool.centre_of_mass=[0.02, 0.01, 0.03]",
)
ROTORS = ("drives.rotor_inertia=1e-4", "drives.lead=10 mm", "drives.ratio=5")
MOVING = (
    "delta",
    "delta-linear",
    "hexapod-rus",
    "planar-3rrr",
    "tripteron",
    "hexapod-hardware",
    "passive-leg-4dof-rus",
)
STRETCHED = ("hexapod", "zhang-gosselin-4dof", "tricept", "passive-leg-5dof")
STENCIL = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0, np.array([2, -27, 270, -490, 270, -27, 2]) / 180.0
"""Differences of order six for a first and a second derivative."""
STEP = 4e-3
POINT = " point"
"""What names of point masses end with."""


def massive(name, *more):
    """A bundled machine in which everything has a mass."""
    plain = load(name)
    links = [f"{p.path}=2 kg/m" for p in parameters(plain.family) if p.path.startswith("linear_density.")]
    down = "load.gravity=[1, 2, 0]" if plain.family.planar else "load.gravity=[1, 2, -9.81]"
    inside = ["tool.centre_of_mass=[0.02, 0.01, 0]"] if plain.family.planar else []
    return load(name, [*MASSES, *ROTORS, *links, down, *inside, *more])


def motions(machine, seed, count=3):
    """Random poses near that of the file, with rates and accelerations."""
    rng = np.random.default_rng(seed)
    names = [path.removeprefix(POSE) for path in values(machine) if path.startswith(POSE)]
    here = np.array([float(values(machine)[POSE + name]) for name in names])
    for _ in range(count):
        yield names, here + rng.uniform(-0.01, 0.01, len(names)), *rng.normal(0.0, [[0.1], [1.0]], (2, len(names)))


def placement(machine, names, numbers):
    there = state_of(with_values(machine, dict(zip([POSE + n for n in names], map(float, numbers), strict=True))))
    platform = there.configuration.platform
    turn = np.array(
        [platform.rotation.x.components(), platform.rotation.y.components(), platform.rotation.z.components()]
    )
    tool = there.machine.reference_point(there.configuration)
    return turn.T.astype(float), np.array(tool.components(), dtype=float)


def platform_motion(machine, names, pose, rates, accelerations):
    """Velocity and angular velocity of the platform at the tool point, and their rates, by differences."""
    steps = STEP * np.arange(-3, 4)
    rows = [placement(machine, names, pose + rates * t + 0.5 * accelerations * t * t) for t in steps]
    (turn, _), turns, places = rows[3], np.array([r for r, _ in rows]), np.array([p for _, p in rows])
    first, second = STENCIL[0] / STEP, STENCIL[1] / STEP**2
    turning = np.einsum("k,kij->ij", first, turns) @ turn.T
    changing = np.einsum("k,kij->ij", second, turns) @ turn.T - turning @ turning
    spin, gain = (np.array([m[2, 1], m[0, 2], m[1, 0]]) for m in (turning, changing))
    return np.concatenate([first @ places, spin]), np.concatenate([second @ places, gain])


def with_even_struts(text):
    """MuJoCo's model with three points in the place of both halves of each strut, as theory (56) by Simpson's rule.

    The square of a velocity that changes evenly along a bar has the mean (first + 4 middle + last) / 6. So a bar that
    stretches evenly has the energy and the weight of a sixth of its mass at each end and the rest in the middle. The
    point in the middle slides on the lower half, half as far as the upper half does.
    """
    root = ElementTree.fromstring(text)
    closing = root.find("equality")
    for near in root.find("worldbody").iter("body"):
        for far in near.findall("body"):
            slide = far.find("joint[@type='slide']")
            if slide is None:
                continue
            name, end = far.get("name"), 2.0 * np.array(far.get("pos").split(), dtype=float)
            mass = sum(float(body.find("inertial").get("mass")) for body in (near, far))
            tip = ElementTree.SubElement(far, "body", name=f"{name}, end{POINT}", pos=numbers_of(end / 2.0))
            middle = ElementTree.SubElement(near, "body", name=f"{name}, middle{POINT}", pos=numbers_of(end / 2.0))
            joint = {"name": middle.get("name"), "type": "slide", "axis": slide.get("axis")}
            ElementTree.SubElement(middle, "joint", joint)
            follows = {"joint1": middle.get("name"), "joint2": slide.get("name"), "polycoef": "0 0.5 0 0 0"}
            ElementTree.SubElement(closing, "joint", follows)
            shares = {near: 0.1 * LIGHT_SHARE, far: 0.1 * LIGHT_SHARE, tip: 1.0 / 6.0, middle: 4.0 / 6.0}
            for body, share in shares.items():
                for inertial in body.findall("inertial"):
                    body.remove(inertial)
                weight, small = repr(mass * share), numbers_of([mass * share * 1e-6] * 3)
                ElementTree.SubElement(body, "inertial", pos="0 0 0", mass=weight, diaginertia=small)
    return ElementTree.tostring(root, encoding="unicode")


def numbers_of(vector):
    return " ".join(repr(float(number)) for number in vector)


class Engine:
    """MuJoCo's equations of a machine at its pose, without what it adds to bodies that have no mass."""

    def __init__(self, machine, stretched=False):
        analysis = analyze(machine)
        text = text_of(analysis, vibrating=True)
        self.model = mujoco.MjModel.from_xml_string(with_even_struts(text) if stretched else text)
        self.model.opt.gravity[:] = machine.tables["load"].gravity
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        known = self.model.body_mass[1:].sum()
        for body in range(1, self.model.nbody):
            name = self.model.body(body).name
            if self.model.body_mass[body] < 2.0 * LIGHT_SHARE * known:
                self.model.body_mass[body], self.model.body_inertia[body] = 0.0, 0.0
            elif not name.startswith(("platform", "mass")) and not machine.family.members:
                self.model.body_inertia[body, np.argmin(self.model.body_inertia[body])] = 0.0  # rods do not spin
        self.data = mujoco.MjData(self.model)
        self.platform = self.model.joint("platform").dofadr[0] + np.arange(6)
        joints = [self.model.joint(i) for i in range(self.model.njnt)]
        for body in range(1, self.model.nbody) if stretched else ():
            if self.model.body(body).name.endswith(POINT):
                self.model.body_inertia[body] = 0.0
        bodies = build(analysis.state.configuration).world.subtree()
        driven = [freedom.name for body in bodies for freedom in body.freedoms if freedom.drive]
        self.drives = [self.model.joint(name).dofadr[0] for name in driven]
        for body in bodies:
            for freedom in body.freedoms if len(body.freedoms) > 1 or stretched else ():
                # Between springs in a row on one body the model has a little inertia, so that it can be stepped, and a
                # drive between the halves of a strut what these lack from a rod that stretches evenly.
                rotor = rotor_inertia(machine, freedom.drive) if freedom.drive else 0.0
                self.model.dof_armature[self.model.joint(freedom.name).dofadr[0]] = rotor
        self.held = [j.dofadr[0] for j in joints if float(np.ravel(j.stiffness)[0]) > 0.0 and j.name not in driven]

    def place(self):
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_makeConstraint(self.model, self.data)

    def closing(self, rates, time):
        """The Jacobian of the closing constraints a moment later."""
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_integratePos(self.model, self.data.qpos, rates, time)
        self.place()
        return self.data.efc_J.reshape(-1, self.model.nv).copy()

    def forces(self, twist, change):
        """Forces of the drives for a motion of the platform (velocity first, as MuJoCo has it)."""
        size = self.model.nv
        closing = self.closing(np.zeros(size), 0.0)
        inner = np.setdiff1d(np.arange(size), [*self.platform, *self.held])
        rates, gains = np.zeros((2, size))
        rates[self.platform], gains[self.platform] = twist, change
        rates[inner] = np.linalg.lstsq(closing[:, inner], -closing[:, self.platform] @ twist, rcond=1e-10)[0]
        assert np.abs(closing @ rates).max() < 1e-8
        turned = sum(w * self.closing(rates, STEP * k) for w, k in zip(STENCIL[0] / STEP, range(-3, 4), strict=True))
        lag = -closing[:, self.platform] @ change - turned @ rates
        gains[inner] = np.linalg.lstsq(closing[:, inner], lag, rcond=1e-10)[0]
        assert np.abs(closing @ gains + turned @ rates).max() < 1e-7
        mujoco.mj_resetData(self.model, self.data)
        self.data.qvel[:] = rates
        self.place()
        mujoco.mj_comVel(self.model, self.data)
        asked = np.zeros(size)
        self.data.qacc[:] = gains
        mujoco.mj_rne(self.model, self.data, 1, asked)  # leaves out the rotors
        asked += self.model.dof_armature * gains
        rows = np.setdiff1d(np.arange(size), self.held)
        ways = np.concatenate([np.eye(size)[:, self.drives], closing.T], axis=1)
        return np.linalg.lstsq(ways[rows], asked[rows], rcond=1e-10)[0][: len(self.drives)]


def apart(machine, moving, stretched=False):
    """The largest difference of the forces from MuJoCo's, as a share of the largest force."""
    result = 0.0
    for names, pose, rates, accelerations in motions(machine, 3):
        there = with_values(machine, dict(zip([POSE + n for n in names], map(float, pose), strict=True)))
        equations = dynamics(there)
        parts = equations.forces((moving * rates).tolist(), accelerations.tolist())
        ours = (parts["weight"] + parts["inertia"]) * equations.senses
        theirs = Engine(there, stretched).forces(*platform_motion(machine, names, pose, moving * rates, accelerations))
        result = max(result, np.abs(ours - theirs).max() / np.abs(theirs).max())
    return result


@pytest.mark.parametrize("name", MOVING)
def test_drives_do_what_mujoco_asks_for(name):
    assert apart(massive(name), 1.0) < AGREED


def test_a_rotor_that_one_drive_has_of_its_own_is_that_of_the_engine():
    assert apart(massive("delta", "drives.leg 2.rotor_inertia=5e-4", "drives.leg 3.ratio=9"), 1.0) < AGREED


def test_telescopes_of_cylinders_and_rods_do_so():
    assert apart(telescopes(), 1.0) < AGREED


@pytest.mark.parametrize("name", STRETCHED)
def test_struts_whose_mass_stretches_evenly_do_so_at_speed(name):
    """All parts are massive: struts, passive leg, platform and rotors. The paper's machine is among them."""
    assert apart(massive(name), 1.0, stretched=True) < AGREED


@pytest.mark.parametrize("name", STRETCHED)
def test_exported_struts_do_so_from_rest(name):
    """In the exported model a strut is two rigid halves, whose masses are apart from an even one's as it stretches."""
    assert apart(massive(name), 0.0) < AGREED
