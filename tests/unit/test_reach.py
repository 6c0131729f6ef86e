"""Reach and status: whether legs close, and the words and codes for it."""

import pytest

from kinetostat.display import ENGINEERING
from kinetostat.kinematics.closing import clearance, why_out_of_reach, within_reach
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.response import pose_status
from kinetostat.machine.loading import load
from kinetostat.machine.machine import Closure, Configuration
from kinetostat.tolerances import SINGULAR


def spanning(*closures):
    whole = load("zhang-gosselin-4dof").configure()
    return Configuration(whole.platform, whole.legs, closures, whole.length)


NEAR = Closure("near leg", span=0.1, shortest=0.2, longest=1.0)
GOOD = Closure("good leg", span=0.5, shortest=0.2, longest=1.0)
FAR = Closure("far leg", span=1.25, shortest=0.2, longest=1.0)


def test_clearance_is_the_distance_from_the_nearest_limit():
    assert clearance(NEAR) == pytest.approx(-0.1)
    assert clearance(GOOD) == pytest.approx(0.3)
    assert clearance(FAR) == pytest.approx(-0.25)


def test_every_leg_must_close():
    assert within_reach(spanning(GOOD))
    assert within_reach(spanning())
    assert not within_reach(spanning(GOOD, NEAR))
    assert not within_reach(spanning(FAR, GOOD))


def test_the_sentence_names_leg_figures_and_way_out():
    message = why_out_of_reach(spanning(GOOD, FAR, NEAR), ENGINEERING)
    for words in ("far leg", "1250 mm", "at most 1000 mm", "nearer", "near leg", "100 mm", "at least 200 mm", "away"):
        assert words in message
    assert "good leg" not in message


def test_of_legs_that_miss_their_reach_alike_the_worst_is_named_and_the_others_are_counted():
    message = why_out_of_reach(spanning(Closure("other leg", 1.2, 0.2, 1.0), FAR, GOOD), ENGINEERING)
    assert message.startswith("The far leg would have to span 1250 mm")
    assert "1 more leg does not reach either" in message
    assert message.count(". ") == 0


def test_the_codes_of_a_status_are_those_of_saved_files():
    assert {status.word: int(status) for status in Status} == {
        "ok": 0,
        "out_of_reach": 1,
        "joint_limit": 2,
        "singular": 3,
        "not_converged": 4,
        "no_rest": 5,
        "undecided": 6,
    }


@pytest.mark.parametrize("status", Status)
def test_every_status_has_its_own_sentence(status):
    assert status.sentence.endswith(".")
    assert [other.sentence for other in Status].count(status.sentence) == 1


@pytest.mark.parametrize(
    ("placed", "reached", "singularity_margin", "limits", "status"),
    [
        (Status.OK, True, 1.0, (), Status.OK),
        (Status.OK, True, SINGULAR / 2, (), Status.SINGULAR),
        (Status.OK, True, float("nan"), (), Status.SINGULAR),
        (Status.OK, False, 1.0, (), Status.OUT_OF_REACH),
        (Status.OK, False, float("nan"), (False, False), Status.OUT_OF_REACH),
        (Status.NOT_CONVERGED, True, 1.0, (), Status.NOT_CONVERGED),
        (Status.SINGULAR, False, float("nan"), (), Status.SINGULAR),
        (Status.OK, True, 1.0, (True, True), Status.OK),
        (Status.OK, True, SINGULAR / 2, (False, True), Status.SINGULAR),
        (Status.OK, True, SINGULAR / 2, (True, False), Status.SINGULAR),
        (Status.OK, True, 1.0, (True, False), Status.JOINT_LIMIT),
        (Status.OK, True, 1.0, (True, False, 1.0), Status.UNDECIDED),
        (Status.OK, True, 1.0, (False, True, 1.0), Status.UNDECIDED),
        (Status.OK, True, SINGULAR / 2, (True, True, 1.0), Status.SINGULAR),
        (Status.OK, True, 1.0, (True, True, 0.0), Status.OK),
    ],
)
def test_the_most_fundamental_obstacle_comes_first(placed, reached, singularity_margin, limits, status):
    assert pose_status(int(placed), reached, singularity_margin, *limits) == status
