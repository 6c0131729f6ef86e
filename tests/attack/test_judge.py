"""The judge notices: defects that were once in the package are put back one by one, and a law or the judge says so."""

import tomllib
from collections import Counter
from pathlib import Path
from random import Random

import laws
import pytest
from grown_machines import machine, parts, parts_of
from hostile import toml
from judging import judged
from laws import Case, response_of

from kinetostat.algebra import solve
from kinetostat.algebra.vector import Vector
from kinetostat.engine.kernel import program_of
from kinetostat.kinematics import leg_gaps
from kinetostat.kinematics.mobility import count_independent
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics import leg, response
from kinetostat.machine.loading import build
from kinetostat.machine.parameters import values, with_values
from kinetostat.machine.written import family
from kinetostat.studies import analysis
from kinetostat.tolerances import DEPENDENT_WRENCHES

CASES = Path(__file__).parents[1] / "cases"


def round_off_decides(patch):
    """Rigid wrenches that coincide up to 1e-12 count as independent."""
    for name in ("CLOSING_ROUND_OFF", "SURELY_MORE"):
        patch.setattr(solve, name, 1e-30)


def round_off_is_felt(patch):
    """A load of round-off on a spring has a direction."""
    patch.setattr(leg, "CLOSING_ROUND_OFF", 1e-30)


def links_begin_at_points(patch):
    """A link behind a parallelogram begins at its near side."""
    patch.setattr(family, "departure", lambda data: Vector(*data.point))


def builds_are_merged(patch):
    """Legs with and without a carriage are placed as one build."""
    patch.setattr(leg_gaps, "_build_key", lambda element: (type(element), element.mover.point is None))


def zeros_are_counted(patch):
    """The rank of C counts what rigid parts leave of it."""

    def rank(_response, statics, _infinite):
        twists = [twist for twist, s in statics.motions if s > 0.0]
        return count_independent(twists, 1.0 / float(statics.length), DEPENDENT_WRENCHES)

    patch.setattr(analysis, "_rank", rank)


def joints_have_round_off_for_a_length(patch):
    """The characteristic length of joints that meet in a point is what round-off leaves of it."""
    for name in ("ONE_PLACE", "LEAST_LENGTH"):
        patch.setattr(family, name, 0.0)


def weight_is_left_out(patch):
    """Actuators carry the wrench of [load] alone."""
    whole = response.load_on_platform

    def without_weight(machine, platform):
        paths = [path for path in values(machine) if path.startswith("load.gravity")]
        return whole(with_values(machine, dict.fromkeys(paths, 0.0)), platform)

    patch.setattr(response, "load_on_platform", without_weight)


def answered(_case):
    """Nothing more than an answer is asked for."""


DEFECTS = [
    (round_off_decides, "ideal-links-exechon", laws.unloaded_rest),
    (round_off_decides, "rigid-or-round-off", laws.inner_laws),
    (round_off_is_felt, "lumped-behind-a-hinge", laws.inner_laws),
    (links_begin_at_points, "link-behind-parallelogram", laws.as_matrices),
    (builds_are_merged, "legs-of-two-builds", answered),
    (zeros_are_counted, "loaded-tripteron", laws.inner_laws),
    (weight_is_left_out, "weight-on-six-legs", laws.weight_as_force),
]


def finding(name, law):
    """What the judge says of a file of tests/cases."""
    text = (CASES / f"{name}.toml").read_text("utf-8")

    def case():
        made = build(text, name)
        return law(Case(tomllib.loads(text), made, response_of(made), Random(name)))

    return judged(case, 600.0)


@pytest.mark.parametrize(("defect", "name", "law"), DEFECTS, ids=lambda x: getattr(x, "__name__", x))
def test_the_judge_notices_a_defect_that_is_put_back(defect, name, law, monkeypatch):
    assert finding(name, law) is None
    defect(monkeypatch)
    program_of.cache_clear()  # programs hold formulas as they were
    try:
        assert finding(name, law)
    finally:
        program_of.cache_clear()


def test_a_length_that_is_round_off_is_never_an_answer_in_silence(monkeypatch):
    """Ranks of joints that meet in a point cannot be told then: the machine is undecided, or a law sees the wrong C."""
    name = "joints-at-one-point"
    made = build((CASES / f"{name}.toml").read_text("utf-8"), name)
    assert response_of(made).status == Status.OK
    assert finding(name, laws.inner_laws) is None
    joints_have_round_off_for_a_length(monkeypatch)
    made = build((CASES / f"{name}.toml").read_text("utf-8"), name)
    assert response_of(made).status == Status.UNDECIDED or finding(name, laws.inner_laws)


def test_machines_that_are_grown_have_answers_and_every_part():
    """Otherwise the laws judge nothing: a grammar of machines that close, of which few are refused."""
    seen, answers = Counter(), 0
    for number in range(60):
        document = machine(Random(f"part {number}"))
        seen.update(parts_of(document))
        answers += int(response_of(build(toml(document), "grown")).status) == Status.OK
    assert answers >= 50
    assert not {part for part in parts() if not seen[part]}
