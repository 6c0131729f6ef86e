"""Springs without stiffness under a load: what moves without limit is said, and everything else keeps its number."""

import json
import math

import pytest

from kinetostat import analyze, bundled, changed, evaluate_grid, guidelines, load
from kinetostat.cli import main
from kinetostat.machine.parameters import parameters
from kinetostat.views.answers import plain_of
from machines import load_without_limits

LOAD = {"load.force.0": 10.0, "load.force.1": 20.0, "load.force.2": -500.0}
SOFT = 1e-3
"""N/m or N·m/rad: nothing beside the other springs."""


def drives(name):
    """Paths of the stiffness of all actuators of a bundled machine; of parts in a row, that of the first."""
    family = load(name).family
    paths = [p.path for p in parameters(family)]
    driven = [f"{table}.stiffness" for table, words in family.literals.items() if words.get("actuated")]
    return [next(path for path in paths if path.startswith(start)) for start in driven or ["stiffness.actuator"]]


@pytest.mark.parametrize("name", bundled())
def test_a_load_on_free_actuators_says_what_it_moves(name):
    analysis = analyze(changed(load_without_limits(name), {**dict.fromkeys(drives(name), 0.0), **LOAD}))
    json.dumps(plain_of(analysis), allow_nan=False)
    if analysis.load is None:  # legs that impose constraints twice share loads by their springs: nothing is balanced
        assert analysis.status.word == "singular"
        assert "Actuators are missing" in analysis.message
        return
    assert any(map(math.isinf, analysis.load.deflection))
    assert "Nothing holds the load: it moves the platform without limit in " in analysis.message


@pytest.mark.parametrize("name", ["hexapod", "orthoglide", "delta", "zhang-gosselin-4dof"])
def test_what_is_finite_beside_a_free_actuator_is_the_limit_of_a_soft_one(name):
    paths = [f"{path}.0" for path in drives(name)]
    free, soft = (
        analyze(changed(load_without_limits(name), {**dict.fromkeys(paths, k), **LOAD})).load for k in (0.0, SOFT)
    )
    round_off = 1e-14 * max(1.0, *map(abs, soft.deflection))
    for without_end, finite in zip(free.deflection, soft.deflection, strict=True):
        if math.isinf(without_end):
            assert abs(finite) > 1.0
        else:
            assert without_end == pytest.approx(finite, rel=1e-6, abs=round_off)
    assert [s.load for s in free.springs] == pytest.approx([s.load for s in soft.springs], rel=1e-6)


def test_a_load_that_does_not_drive_the_free_actuator_deflects_as_ever():
    free = analyze(changed(load("orthoglide"), {"stiffness.actuator.0": 0.0, "load.force.2": -500.0}))
    held = analyze(changed(load("orthoglide"), {"load.force.2": -500.0})).load
    assert free.load.deflection.tolist() == held.deflection.tolist()
    assert "Nothing holds" not in free.message


def test_guidelines_of_a_machine_without_elements_say_that_it_is_free(capsys):
    assert main(["guidelines", "hexapod", "--set", "stiffness.actuator=0"]) == 0
    assert "The platform is free in every direction." in capsys.readouterr().out
    assert guidelines(load("hexapod", "stiffness.actuator=0"), "z=12 cm:14 cm:2").elements == ()


def test_a_grid_takes_a_free_actuator_in_legs_that_share_loads():
    grid = evaluate_grid(load("delta", "stiffness.actuator.0=0"), "x=-1 cm:1 cm:3", "compliance_z")
    assert grid.compliance_z.values == pytest.approx(math.inf)
    assert main(["sweep", "tripteron", "--vary", "z=-1 m:1 m:5", "--set", "legs.z.slide.stiffness=0"]) == 1
