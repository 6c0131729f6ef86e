"""Machines rebuilt in engines that are not ours: a multibody code and a frame code, from points, axes and sections."""

import json
import random
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from kinetostat.algebra.vector import AXES, X_AXIS, Y_AXIS, Z_AXIS, Vector, rotation_x
from kinetostat.machine.leg import RIGID, Joint, Leg, Spring, revolutes
from kinetostat.machine.link import Beam, Rigidity
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Plane
from kinetostat.machine.parameters import values, with_values
from kinetostat.machine.parts import two_force_leg
from kinetostat.validation import comparison
from kinetostat.validation.comparison import KNOWN, block_differences, engines, validate
from kinetostat.validation.pieces import StrutPiece, end_compliance, pieces
from kinetostat.validation.pynite_machine import extrapolate
from machines import CASES, is_regular, load_without_limits
from refusals import refused

REACHED = {"exudyn": 1e-9, "pynite": 1e-6}
"""Relative difference that each engine stays below; measured: 2e-11 and 3e-8."""

each_engine = pytest.mark.parametrize("engine", REACHED)
each_machine = pytest.mark.parametrize("case", CASES, ids=repr)


@cache
def bundled_validation(name, engine):
    """The validation of a bundled machine, for all tests that read it."""
    return validate(load_without_limits(name), engine)


@each_engine
@each_machine
def test_a_bundled_machine_agrees_with_the_engine(case, engine):
    validation = bundled_validation(case.name, engine)
    assert validation.difference < REACHED[engine], validation.differences
    assert validation.uncertainty < 100 * REACHED[engine]


def variations(case, count):
    """Designs with random geometry, pose and tool; stiffnesses as bundled, where every part has its say."""
    draw = random.Random(case.name)
    found = []
    while len(found) < count:
        drawn = {path: draw.uniform(*span) for path, span in case.ranges.items()}
        machine = with_values(case.machine, drawn)
        if is_regular(machine):
            found.append(machine)
    return found


LONGEST = "hexapod-hardware", "exudyn"
"""This engine takes more than a minute for a design of this machine: it solves the bundled one alone."""


@pytest.mark.parametrize(
    ("case", "engine"), [(c, e) for c in CASES for e in REACHED if (c.name, e) != LONGEST], ids=repr
)
def test_other_designs_and_poses_agree_too(case, engine):
    for machine in variations(case, 1 if case.name == LONGEST[0] else 2):
        validation = validate(machine, engine)
        assert validation.difference < REACHED[engine], validation.differences


@each_engine
@pytest.mark.parametrize("name", ["hexapod", "delta", "tripteron", "planar-3rrr", "zhang-gosselin-4dof"])
def test_the_engine_does_not_follow_our_mistakes(name, engine):
    """A machine that we had got wrong by one percent in one length or stiffness would be found out."""
    right = load(name)
    soft = next(path for path in values(right) if "stiffness" in path)
    wrong = with_values(right, {soft: 1.01 * values(right)[soft]})
    differences = block_differences(validate(wrong, engine).theirs, bundled_validation(name, engine).ours, 1.0)
    assert max(differences.values()) > 1e-4


def test_nonlinear_statics_converge_quadratically_to_our_c():
    (_, finest), (_, fine), (_, coarse) = bundled_validation("hexapod", "exudyn").trials
    assert fine < coarse / 50
    assert finest < fine / 50


@pytest.mark.parametrize("held", ["rigid", "1e5 N*m/rad"])
def test_directions_that_the_machine_holds_rigidly(held):
    """Rows of zeros in C, not small numbers that happen to agree."""
    machine = load("zhang-gosselin-4dof", [f'stiffness.passive_links=["rigid", "{held}"]'])
    validation = validate(machine, "exudyn")
    assert validation.difference < 1e-9
    assert np.linalg.matrix_rank(validation.theirs * 1e3, tol=1e-9) == (4 if held == "rigid" else 5)


def test_a_machine_without_anything_that_yields_is_refused():
    """Both would say C = 0, which compares nothing."""
    with refused("Every part is rigid"):
        validate(load("hexapod", ["stiffness.actuator=rigid"]))


def test_a_leg_of_two_spherical_joints_is_a_strut():
    leg = two_force_leg("leg 1", Vector(0.0, 0.0, 0.0), Vector(0.1, 0.0, 0.4), 2e6, 1e6)
    (strut,) = pieces(leg)
    length = (0.1**2 + 0.4**2) ** 0.5
    assert isinstance(strut, StrutPiece)
    assert strut.stiffness == pytest.approx(1.0 / (1.0 / 2e6 + length / 1e6), rel=1e-14)


def test_a_chain_keeps_what_moves_and_loses_what_is_rigid():
    chain = (
        Spring("free", Joint(X_AXIS), 0.0),
        Spring("stiff", Joint(Y_AXIS), RIGID),
        Spring("soft", Joint(Z_AXIS), 5.0),
        *revolutes(Vector(0.0, 0.0, 1.0), AXES[:2]),
    )
    free, soft, *joints = pieces(Leg("leg", chain))
    assert (free, soft) == (chain[0].joint, chain[2])
    assert joints == list(chain[3:])


def test_out_of_plane_joints_of_a_planar_machine_do_nothing():
    chain = (Joint(X_AXIS, Vector(0.0, 0.0, 0.0)), Joint(Z_AXIS, Vector(0.0, 0.0, 0.0)), Joint(X_AXIS))
    assert pieces(Leg("leg", chain), Plane()) == chain[1:]


def test_an_askew_joint_of_a_planar_machine_is_refused():
    askew = rotation_x(0.8, 0.6).apply(Z_AXIS)
    with refused("must lie in the plane of the planar machine or be perpendicular"):
        pieces(Leg("leg", (Joint(askew, Vector(0.0, 0.0, 0.0), "hinge"),)), Plane())


def test_the_textbook_cantilever():
    beam = Beam("arm", Vector(0.0, 0.0, 0.0), Vector(2.0, 0.0, 0.0), Z_AXIS, Rigidity(8.0, 6.0, 3.0, 5.0, 10.0, 20.0))
    compliance = end_compliance(beam)
    assert np.allclose(compliance, compliance.T)
    assert np.diag(compliance) == pytest.approx([2 / 6, 2 / 3, 2 / 5, 2 / 8, 8 / 15 + 0.2, 8 / 9 + 0.1])
    assert compliance[4, 2] == pytest.approx(2.0 / 5.0)
    assert compliance[5, 1] == pytest.approx(-2.0 / 3.0)


def test_extrapolation_finds_the_limit_and_says_how_well():
    steps = [0.5**n for n in range(8)]
    limit = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    found, second_best = extrapolate(steps, [limit * (1.0 + 0.3 * h / (1.0 + 0.1 * h)) for h in steps], 1.0)
    assert np.abs(found - limit).max() < 1e-9
    assert np.abs(found - limit).max() < np.abs(second_best - found).max() < 1e-7


def test_what_pynite_cannot_build_it_refuses():
    base = load("hexapod").configure()
    engine = next(e for e in KNOWN if e.name == "pynite")
    bent = Beam("arm", Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.1), X_AXIS, Rigidity(1e6, 1e3, 1e3, 1e3, 1e6, 1e6))
    screw = Joint(Z_AXIS, Vector(0.0, 0.0, 0.0), "screw", 0.01)
    for part, reason in ((bent, "shear"), (screw, "screw")):
        machine = type(base)(base.platform, (*base.legs, Leg("extra", (part,))), (), base.length)
        with refused(f"{reason}.*use Exudyn"):
            engine.solve(machine, base.platform.translation)


def test_stiffnesses_too_far_apart_for_pynite_are_refused():
    machine = load("zhang-gosselin-4dof", ['stiffness.passive_links=["rigid", "1e12 N*m/rad"]'])
    with refused(r"seven decades.*use Exudyn"):
        validate(machine, "pynite")


def test_a_missing_engine_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr(comparison, "find_spec", lambda _: None)
    assert engines() == {}
    for asked in (None, "pynite"):
        with refused(r"Install it with `.*(exudyn|PyNite|validate).*`"):
            validate(load("hexapod"), asked)


def test_an_unknown_engine_is_named():
    with refused(r'no engine "ansys".*exudyn, pynite'):
        validate(load("hexapod"), "ansys")


def test_a_free_machine_has_nothing_to_compare():
    with refused("free"):
        validate(load("hexapod", ["stiffness.actuator=0"]), "exudyn")


def test_engines_are_silent_and_write_nothing(tmp_path):
    code = "; ".join(
        [
            "from kinetostat.machine.loading import load",
            "from kinetostat.validation.comparison import engines, validate",
            "import json",
            "print(json.dumps([validate(load('hexapod'), e).difference for e in engines()]))",
        ]
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert len(json.loads(done.stdout)) == len(engines())
    assert not list(tmp_path.iterdir())
