"""Numbers that are hardly meant are pointed out; those of machines that there are, are not."""

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.machine.loading import bundled, load
from kinetostat.machine.parameters import doubts


@pytest.mark.parametrize("name", bundled())
def test_no_bundled_machine_is_doubted(name):
    assert not list(doubts(load(name)))


@pytest.mark.parametrize(
    ("name", "setting", "words"),
    [
        ("hexapod", "pose.roll=90", ["pose.roll is 90 rad, more than a turn", '"90 deg"']),
        ("hexapod", "geometry.base_radius=400", ["geometry.base_radius is 400 m", '"400 mm"']),
        ("hexapod", "stiffness.actuator.2=45", ["stiffness.actuator.2 is 45 N/m", '"45 N/um"']),
        ("hexapod", "tool.offset=[0, 0, -80]", ["tool.offset.2 is -80 m", '"-80 mm"']),
    ],
)
def test_a_number_in_another_unit_is_pointed_out(name, setting, words):
    (doubt,) = doubts(load(name, [setting]))
    for word in words:
        assert word in doubt


@pytest.mark.parametrize("setting", ["pose.roll=-180 deg", "pose.yaw=360 deg", "stiffness.actuator=0", "pose.x=1 mm"])
def test_what_may_be_meant_is_not(setting):
    assert not list(doubts(load("hexapod", [setting])))


@pytest.mark.parametrize("command", ["check", "analyze"])
def test_commands_point_it_out_and_go_on(command, capsys):
    assert main([command, "hexapod", "--set", "stiffness.actuator=45"]) == DONE
    assert capsys.readouterr().out.count("Note: stiffness.actuator is 45 N/m") == 1
