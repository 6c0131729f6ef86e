"""Optimisers against each other, against enumeration and against known fronts."""

from types import SimpleNamespace

import numpy as np
import pytest
from pymoo.indicators.hv import HV

from kinetostat.studies.optimisation import slopes
from kinetostat.studies.optimisation.assessment import Assessor, Outcome
from kinetostat.studies.optimisation.generations import Genetic
from kinetostat.studies.optimisation.log import Log, front_of, knee_of, record_of
from kinetostat.studies.optimisation.search import search
from kinetostat.studies.optimisation.slopes import Surveyor
from studies import FEW, best, problem, solved, written

REGION = "zhang-gosselin-region"
WIDE = (
    *FEW,
    'variables.4.from="0 deg"',
    'variables.4.to="60 deg"',
    'variables.5.to="85 deg"',
    'variables.0.from="4 cm"',
    'variables.0.to="40 cm"',
    "objectives.0.weights=[0.1,0.1,1,1,1,100]",
    "optimizer.starts=6",
)
"""Bounds so wide that the best design lies inside, where several poses are equally bad."""


@pytest.mark.parametrize(
    ("settings", "close"),
    [
        (FEW, 1e-6),
        (WIDE, 3e-2),
        ((*FEW, "objectives.0.over=mean", "constraints.0.at_least=0.12", 'constraints.1.at_most="19 cm"'), 2e-2),
        ((*FEW, "robustness.objective=worst", "robustness.search_samples=8"), 1e-6),
        ((*FEW, "objectives.0.quantity=least_translational_stiffness"), 1e-6),
    ],
    ids=["worst", "kinks", "constraints", "robust", "maximised"],
)
def test_unrelated_optimisers_agree(settings, close):
    """Genetic and gradient search over several poses; the second is never worse."""
    by_genes, by_slopes = (best(solved(REGION, *settings, f"optimizer.method={m}")) for m in ("genetic", "gradient"))
    assert by_genes == pytest.approx(by_slopes, rel=close)
    larger = any("stiffness" in setting for setting in settings)
    assert (by_slopes - by_genes) * (-1 if larger else 1) <= 1e-6 * abs(by_genes)


@pytest.mark.parametrize("over", ["worst", "mean", "percentile 80"])
@pytest.mark.parametrize(
    "quantity", ["compliance_sum", "stiffness_along", "leg_stroke", "frobenius_condition", "singularity_margin"]
)
def test_derivatives_over_poses_are_those_of_differences(quantity, over):
    direction = ["objectives.0.direction=[1, 0, 2]"] if quantity == "stiffness_along" else []
    study = problem(REGION, *FEW, f"objectives.0.quantity={quantity}", f"objectives.0.over={over}", *direction)
    assess, survey = Assessor(study), Surveyor(study, searching=True)
    genes, step = np.array([0.31, 0.62, 0.41, 0.27, 0.53, 0.74]), 1e-5
    objective = study.objectives[0]
    value, slope = survey(genes).term(objective.term, objective.sign > 0)
    assert value == pytest.approx(assess(genes[None]).objectives[0, 0], rel=1e-12)
    moved = np.concatenate([genes + step * np.eye(6), genes - step * np.eye(6)])
    found = assess(moved).objectives[:, 0].reshape(2, 6)
    np.testing.assert_allclose(slope, (found[0] - found[1]) / (2.0 * step), rtol=1e-5, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("over", ["worst", "mean", "percentile 70"])
@pytest.mark.parametrize("robust", ["worst", "mean", "percentile 80"])
def test_derivatives_under_tolerances_are_those_of_differences(robust, over):
    settings = (f"robustness.objective={robust}", "robustness.search_samples=7", f"objectives.0.over={over}")
    study = problem(REGION, *FEW, *settings, 'variables.0.tolerance="3 mm"')
    assess, survey = Assessor(study), Surveyor(study, searching=True)
    genes, step = np.array([0.31, 0.62, 0.41, 0.27, 0.53, 0.74]), 1e-5
    value, slope = survey(genes).term(study.objectives[0].term, True)
    assert value == pytest.approx(assess(genes[None]).objectives[0, 0], rel=1e-12)
    found = assess(np.concatenate([genes + step * np.eye(6), genes - step * np.eye(6)])).objectives.reshape(2, 6)
    np.testing.assert_allclose(slope, (found[0] - found[1]) / (2.0 * step), rtol=1e-5, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize(("searching", "compiled"), [(True, [True] * 3), (False, [False, False, True])])
def test_derivatives_are_compiled_where_many_are_asked_for(monkeypatch, searching, compiled):
    """To explain a design a few evaluations do, and a search by derivatives compiles at once; numbers are the same."""
    monkeypatch.setattr(slopes, "COMPILE_FROM", 2)
    study = problem(REGION, *FEW)
    survey, asked = Surveyor(study, searching), []
    differentiate = slopes.differentiate

    def note(*given):
        asked.append(given[-1])
        return differentiate(*given)

    monkeypatch.setattr(slopes, "differentiate", note)
    genes = np.array([0.31, 0.62, 0.41, 0.27, 0.53, 0.74])
    answers = [survey(genes) for _ in range(3)]
    assert asked == compiled
    for name in study.names:
        for other in answers[1:]:
            np.testing.assert_allclose(answers[0].slopes[name], other.slopes[name], rtol=1e-10)


def hypervolume(points, reference):
    return float(HV(ref_point=np.asarray(reference))(np.asarray(points)))


def test_the_front_of_a_study_is_that_of_enumeration():
    """Two variables on a grid of 300 x 300 designs, against NSGA-II: one percent of the hypervolume."""
    settings = ("variables.2.fixed=true", "optimizer.population=100", "optimizer.generations=60", "optimizer.seed=2")
    log = solved("zhang-gosselin-front", *settings)
    found = log.outcome(front_of(log)).objectives
    lows, highs = found.min(axis=0), found.max(axis=0)
    ticks = np.linspace(0.0, 1.0, 300)
    genes = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    every = Assessor(log.problem)(genes).objectives
    exact, reached = (hypervolume((points - lows) / (highs - lows), [1.1, 1.1]) for points in (every, found))
    assert reached == pytest.approx(exact, rel=0.01)


class Zdt1:
    """ZDT1: f1 = x1, f2 = g (1 - sqrt(f1 / g)) with g = 1 + 9 mean(x2 ...); the front is f2 = 1 - sqrt(f1).

    Zitzler, Deb and Thiele, Comparison of multiobjective evolutionary algorithms, Evolutionary Computation 8 (2000).
    """

    SIZE = 30

    def __init__(self, population, generations):
        optimizer = SimpleNamespace(seed=1, population=population, generations=generations)
        space = SimpleNamespace(
            size=self.SIZE, catalogue=np.zeros(self.SIZE, int), holds=lambda _: False, initial=np.zeros(self.SIZE)
        )
        objectives = (SimpleNamespace(sign=1.0), SimpleNamespace(sign=1.0))
        study = SimpleNamespace(optimizer=optimizer)
        self.problem = SimpleNamespace(study=study, space=space, objectives=objectives, constraints=())

    def __call__(self, genes):
        g = 1.0 + 9.0 * genes[:, 1:].mean(axis=1)
        values = np.column_stack([genes[:, 0], g * (1.0 - np.sqrt(genes[:, 0] / g))])
        return Outcome(values, np.empty((len(genes), 0)), np.zeros(len(genes)), np.zeros(len(genes), dtype=np.int8))


def test_nsga2_finds_a_front_known_in_closed_form():
    """Hypervolume of f2 = 1 - sqrt(f1) from (1, 1) is the integral of the root, 2/3; the knee is where f' = -1."""
    assess = Zdt1(200, 200)
    log, method = Log(assess.problem), Genetic(assess, crowded=True)
    for number in range(method.steps):
        step = method.step(number, log)
        record = record_of(log, step)
        log.add(log.as_rows(step), record)
    front = front_of(log)
    points = log.outcome(front).objectives
    assert hypervolume(points, [1.0, 1.0]) == pytest.approx(2.0 / 3.0, rel=0.01)
    assert points[knee_of(log, front), 0] == pytest.approx(0.25, abs=0.03)
    assert np.all(np.diff(points[:, 0]) > 0)


CATALOGUE = """
schema = 1
name = "actuators"
machine = "zhang-gosselin-4dof"
[set]
stiffness.passive_links = "1e7 N*m/rad"
load.force = ["0 N", "0 N", "-500 N"]
[[variables]]
path = "platform_radius"
from = "10 cm"
to = "14 cm"
[[variables]]
paths = ["stiffness.actuator", "limits.actuator_force"]
choices = [["4000 N/m", "500 N"], ["2000 N/m", "3 kN"], ["1000 N/m", "9 kN"]]
labels = ["stiff and weak", "middle", "soft and strong"]
[[objectives]]
quantity = "compliance_z"
[optimizer]
population = 20
generations = 15
"""


@pytest.mark.parametrize("method", ["genetic", "hybrid", "gradient"])
def test_a_catalogue_is_chosen_from(method):
    """The stiffest actuator is too weak for the load; of the others the stiffer one is best."""
    log = search(Assessor(written(CATALOGUE, f"optimizer.method={method}")))
    chosen = log.genes(log.survivors[:1])[0, 1]
    assert chosen == 1.0
    outcome = log.outcome()
    weak = log.genes()[:, 1] == 0.0
    assert weak.any()
    assert (outcome.verdict[weak] == 2).all(), "joint_limit"
    assert set(log.genes()[:, 1]) <= {0.0, 1.0, 2.0}
