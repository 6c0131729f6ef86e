"""Natural frequencies by other programs: Exudyn's linearised equations, and MuJoCo's free vibration in time."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from kinetostat import analyze, build, changed, load
from kinetostat.equilibrium.balance import balance, free_state
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.exchange.mjcf import text_of
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import as_toml
from kinetostat.machine.parameters import values
from kinetostat.validation.comparison import KNOWN, frequency_pairs, validate
from kinetostat.vibration.modes import modes
from machines import CASES, with_bodies
from refusals import refused

pytest.importorskip("exudyn")
EXUDYN = KNOWN[0]
REACHED = 1e-7
"""Relative difference of frequencies; measured: 4e-9 where stiffnesses differ by nine decades, 1e-12 elsewhere."""
PLATFORM = [
    "tool.mass=5",
    "tool.centre_of_mass=[0.01, 0.02, 0.03]",
    "tool.inertia=[0.05, 0.06, 0.07, 0.004, -0.003, 0.002]",
    "tool.payload=2",
    "tool.payload_centre=[0.01, -0.02, 0.05]",
    "tool.payload_inertia=[0.004, 0.003, 0.002, 0.0005, 0.0, -0.0004]",
]
ROTORS = ["drives.rotor_inertia=2e-5", "drives.lead=5 mm", "drives.ratio=20"]


def heavy(name, *more):
    """A bundled machine with a massive platform, and all links that have a density."""
    machine = load(name)
    kinds = () if machine.family.members is not None else machine.family.links
    densities = [f"linear_density.{k.name}={0.5 if k.count is None else [0.5] * k.count}" for k in kinds]
    return load(name, [*PLATFORM, *densities, *more])


def compare(machine):
    """Compare the lowest frequencies and return the engine's, Hz."""
    ours, theirs = np.transpose(frequency_pairs(machine, EXUDYN))
    assert ours == pytest.approx(theirs, rel=REACHED)
    return theirs


@pytest.mark.parametrize("case", CASES, ids=repr)
def test_exudyn_has_the_same_frequencies(case):
    still = compare(heavy(case.name))
    turning = compare(heavy(case.name, *ROTORS))
    assert turning[0] < 0.9999 * still[0], "rotors are heavy"


def test_exudyn_agrees_with_the_closed_form_of_a_rigid_body_on_a_cubic_hexapod():
    """K = k diag(1.5 Hc², 1.5 Hc², 6 Hc², 2, 2, 2) about the cube's centre; the body's centre is h above it.

    Surge x and pitch ry make one pair: M = [m, m h; m h, I + m h²], K = diag(2 k, 1.5 k Hc²); heave and spin are alone.
    """
    stiffness, size, mass, across, along, h = 20e6, 0.1, 7.0, 0.12, 0.2, 0.03
    inertia = [across, across, along, 0, 0, 0]
    settings = [f"tool.mass={mass}", f"tool.centre_of_mass={[0, 0, h]}", f"tool.inertia={inertia}"]
    machine = load("hexapod-cubic", settings)
    half = 0.5 * (2.0 / mass + 2.0 * h**2 / across + 1.5 * size**2 / across)
    root = np.sqrt(half**2 - 3.0 * size**2 / (mass * across))
    squares = [half - root, half - root, half + root, half + root, 2.0 / mass, 6.0 * size**2 / along]
    wanted = np.sort(np.sqrt(np.multiply(squares, stiffness))) / (2.0 * np.pi)
    assert EXUDYN.frequencies(machine) == pytest.approx(wanted, rel=1e-10)


@pytest.mark.parametrize("name", ["tripteron", "delta", "hexapod", "planar-3rrr"])
def test_exudyn_has_the_same_frequencies_with_links_that_are_bodies(name):
    machine = with_bodies(name, PLATFORM)
    first = compare(machine)
    still = changed(machine, {path: 0.0 for path in values(machine) if ".inertia." in path and path.startswith("legs")})
    assert compare(still)[-1] > 1.001 * first[-1], "inertia of links matters"
    assert compare(build(as_toml(machine))) == pytest.approx(first, rel=REACHED), "the file says all of it"


def test_masses_that_differ_are_detected():
    """Arms that are one percent heavier show, light as they are."""
    right = heavy("delta")
    theirs = EXUDYN.frequencies(heavy("delta", "linear_density.arms=0.505"))
    ours = np.array([pair[0] for pair in frequency_pairs(right, EXUDYN)])
    assert np.abs(theirs[: len(ours)] / ours - 1.0).max() > 100 * REACHED


def test_the_answer_has_both_and_none_without_a_mass():
    validation = validate(load("hexapod", ["tool.mass=5 kg"]), "exudyn")
    assert len(validation.frequencies) == 3, "the mass has no size, and no motion turns it only"
    assert validation.frequency_difference < 1e-10
    assert validate(load("hexapod"), "exudyn").frequencies == ()
    assert validate(load("planar-3rpr", ["tool.mass=5 kg"]), "pynite").frequencies == (), "it has no modes here"


PERIODS = 10
"""Of free vibration, after a push that lasts two more."""
VIBRATING = {
    "hexapod": ["tool.mass=5", "tool.centre_of_mass=[0.01, 0.02, 0.03]", "linear_density.legs=2"],
    "hexapod-rus": ["tool.mass=30", "linear_density.cranks=8", "linear_density.rods=3"],
}
"""Machines whose bodies in MuJoCo carry masses that the machine has: struts, cranks, rods and springs in a row."""


@pytest.mark.parametrize("name", VIBRATING)
def test_mujoco_vibrates_at_the_frequency_of_the_third_mode(name):
    """The push K shape and the signal shape^T K motion have next to nothing of other modes."""
    mujoco = pytest.importorskip("mujoco")
    machine = load(name, VIBRATING[name])
    response = respond(machine)
    mechanism = mechanism_of(machine, response.configuration, None)
    answer = modes(balance(mechanism, free_state(mechanism)))
    wanted, shape = answer.frequencies[2], answer.tool[:, 2]
    model = mujoco.MjModel.from_xml_string(text_of(analyze(machine), vibrating=True))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    site, platform = data.site("tool"), data.body("platform")
    start, axes = np.array(site.xpos), np.array(site.xmat).reshape(3, 3)
    push = np.linalg.solve(np.array(response.compliance.rows(), dtype=float), shape)
    size = 1e-6 / np.abs(shape).max()
    step, period = model.opt.timestep, 1.0 / wanted
    signal = []
    for number in range(int((PERIODS + 2) * period / step)):
        share = max(0.0, np.sin(np.pi * number * step / (2.0 * period))) if number * step < 2.0 * period else 0.0
        platform.xfrc_applied[:] = share * size * np.array([*push[3:], *push[:3]])
        mujoco.mj_step(model, data)
        spin = np.array(site.xmat).reshape(3, 3) @ axes.T
        turn = 0.5 * np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]])
        signal.append(push @ np.concatenate([turn, np.array(site.xpos) - start]))
    free = np.array(signal[int(2.0 * period / step) :])
    times = step * np.arange(len(free))

    def left(frequency):
        waves = np.column_stack([np.cos(2 * np.pi * frequency * times), np.sin(2 * np.pi * frequency * times)])
        return np.linalg.norm(free - waves @ np.linalg.lstsq(waves, free, rcond=None)[0]) / np.linalg.norm(free)

    best = minimize_scalar(left, bounds=(0.98 * wanted, 1.02 * wanted), method="bounded", options={"xatol": 1e-6})
    assert left(best.x) < 0.02, "nothing is lost, and hardly anything else vibrates"
    assert best.x == pytest.approx(wanted, rel=3e-4)


def test_mujoco_needs_a_mass_to_vibrate():
    with refused("Nothing of this machine has a mass"):
        text_of(analyze(load("hexapod")), vibrating=True)
