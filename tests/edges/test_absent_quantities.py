"""What the file of a machine does not say is not known: no number stands for a mass or a load that nobody gave."""

import numpy as np
import pytest

from kinetostat.cli import main
from kinetostat.machine.loading import load
from kinetostat.studies.datasets import evaluate_grid
from kinetostat.studies.sensitivity import sensitivity
from refusals import refused

OVER = ["x=-10 mm:10 mm:3"]


@pytest.mark.parametrize(
    ("quantity", "field"),
    [("mass", '[tool] mass = "12 kg"'), ("actuator_force", "table [load]"), ("actuator_force", "force = [")],
)
def test_what_no_file_says_is_refused_with_what_to_add(quantity, field, capsys):
    assert main(["map", "hexapod", "--over", *OVER, "--over", "y=-10 mm:10 mm:3", "--quantity", quantity]) == 2
    assert field in capsys.readouterr().err
    assert main(["sensitivity", "hexapod", "--quantity", quantity]) == 2
    assert "is not known" in capsys.readouterr().err


@pytest.mark.parametrize("condition", ["mass < 60 kg", "actuator_force < 1 kN"])
def test_no_condition_passes_on_what_is_not_known(condition, capsys):
    assert main(["workspace", "hexapod", "--over", *OVER, "--over", "y=-10 mm:10 mm:3", "--where", condition]) == 2
    assert "is not known" in capsys.readouterr().err


def test_what_the_file_or_the_range_says_is_answered():
    weighed = evaluate_grid(load("hexapod", ["tool.mass=12 kg"]), OVER, ["mass"])
    assert np.all(weighed["mass"] >= 12.0)
    assert evaluate_grid(load("hexapod"), ["tool.mass=1 kg:3 kg:3"], ["mass"])["mass"].values == pytest.approx(
        [1, 2, 3]
    )
    pushed = evaluate_grid(load("hexapod"), ["load.force.2=0 N:200 N:3"], ["actuator_force"])["actuator_force"].values
    assert pushed[0] == 0.0
    assert pushed[2] == pytest.approx(2 * pushed[1])
    assert sensitivity(load("hexapod", ["load.force=[0, 0, 5]"]), ["actuator_force"]).indices[0] > 0.0


def test_a_part_that_is_missing_is_told_before_a_load():
    with refused("an actuated revolute"):
        evaluate_grid(load("hexapod"), OVER, ["actuator_moment"])
