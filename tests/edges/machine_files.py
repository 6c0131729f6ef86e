"""A good machine file to spoil, and how its refusal is looked at."""

from kinetostat.machine.loading import load
from refusals import refused

NAME = "zhang-gosselin-4dof"
GOOD = """\
schema = 1
name = "test machine"
family = "passive-leg-4dof"
[geometry]
base_radius = "22 cm"
platform_radius = "12 cm"
base_angle = "30 deg"
platform_angle = "60 deg"
passive_links = ["68 cm", "68 cm"]
[stiffness]
actuator = "1000 N/m"
passive_links = ["rigid", "1e7 N*m/rad"]
[pose]
x = "0 cm"
z = "68 cm"
theta5 = "-60 deg"
theta6 = "120 deg"
"""
HUGE_NUMBER = "9" * 5000


def refusal(machine, *settings):
    """The message of the refusal: one readable paragraph of bounded length."""
    with refused() as caught:
        load(machine, settings)
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) < 2000
    assert "Traceback" not in message
    return message
