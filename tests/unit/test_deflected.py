"""The deflected shape: every leg follows the platform and stays on the base, whatever its joints and springs."""

import pytest

from kinetostat.algebra.screw import Twist, Wrench
from kinetostat.algebra.vector import ZERO, Vector
from kinetostat.kinetostatics.loading import DeflectedLink, deflected_links, deflection
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from machines import every_machine

LOAD = Wrench(Vector(3.0, -2.0, 1.0), Vector(40.0, 70.0, -90.0))
PLANE_LOAD = Wrench(Vector(0.0, 0.0, 1.0), Vector(40.0, 70.0, 0.0))


@every_machine
def test_the_legs_follow_the_platform(case):
    response = respond(case.machine)
    wrench = PLANE_LOAD if response.configuration.plane else LOAD
    links = deflected_links(response, wrench)
    platform = deflection(response.statics, wrench)
    for leg in (leg for leg in response.configuration.legs if len(leg.stations) > 1):
        last = [link for link in links if link.leg == leg.name][-1]
        expected = platform.at_offset(last.end - response.reference).translational.components()
        size = max(abs(c) for c in (*platform.rotational.components(), *platform.translational.components()))
        assert last.end_motion.translational.components() == pytest.approx(expected, rel=1e-6, abs=1e-9 * size)


@every_machine
def test_a_leg_stays_where_it_is_mounted(case):
    """Its first point moves only where a slide along a rail lies before it."""
    response = respond(case.machine)
    for leg in (leg for leg in response.configuration.legs if len(leg.stations) > 1):
        first = next(link for link in deflected_links(response, LOAD) if link.leg == leg.name)
        if leg.chain[0].path or leg.chain[0].mover.point is not None:
            assert first.start_motion.translational.norm() < 1e-9 * first.end_motion.translational.norm()


def test_a_beam_bends_as_a_cantilever_does():
    """Tip displacement d and slope 3 d / 2 L: the cubic between the ends is the textbook's, x^2 (3 L - x) / 2 L^3."""
    link = DeflectedLink(
        "leg", ZERO, Vector(2.0, 0.0, 0.0), Twist(ZERO, ZERO),
        Twist(Vector(0.0, 0.0, 1.5 * 0.01 / 2.0), Vector(0.0, 0.01, 0.0)),
    )  # fmt: skip
    for x in (0.5, 1.0, 1.7):
        assert link.point(x / 2.0, 1.0).y == pytest.approx(0.01 * x * x * (6.0 - x) / 16.0, rel=1e-12)


def test_a_rigid_link_stays_straight_and_displacements_grow_with_the_factor():
    turn = Twist(Vector(0.0, 0.0, 0.01), ZERO)
    link = DeflectedLink("leg", ZERO, Vector(2.0, 0.0, 0.0), turn, turn.at_offset(Vector(2.0, 0.0, 0.0)))
    assert link.point(0.5, 1.0).y == pytest.approx(0.01)
    assert link.point(0.5, 100.0).y == pytest.approx(1.0)


def test_the_paper_machine_moves_by_what_its_springs_give():
    """Under a force along y only the passive leg's springs give: the legs' rods do not change their length."""
    response = respond(load("zhang-gosselin-4dof"))
    wrench = Wrench(ZERO, Vector(0.0, 100.0, 0.0))
    rods = [link for link in deflected_links(response, wrench) if link.leg.startswith("leg ")]
    assert len(rods) == 4
    for rod in rods:
        stretch = (rod.end_motion.translational - rod.start_motion.translational).dot(rod.end - rod.start)
        assert abs(stretch) < 1e-12
