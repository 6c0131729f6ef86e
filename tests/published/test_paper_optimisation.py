"""Section 4.3 of the paper: seven dimensions for the least sum of compliances, by two unrelated methods.

The minimum is from an implementation independent of this project (with rigid passive links 1.01788945). The paper's
genetic algorithm found 1.017897 with 80 designs in 100 generations.
"""

import numpy as np
import pytest

from kinetostat.studies.optimisation.assessment import Assessor
from kinetostat.studies.optimisation.search import optimize
from kinetostat.views.optimisation import variables_of
from studies import BEST, PAPER, best, problem, solved

PRINTED = 1.017897
ALLOWED = 1.0178895
"""Half a unit of the last digit above the minimum."""
RIGID = 'set.stiffness.passive_links="rigid"'
BOX = {
    "geometry.platform_radius": 0.14,
    "geometry.base_radius": 0.26,
    "pose.z": 0.66,
    "geometry.base_angle": np.radians(35),
    "geometry.platform_angle": np.radians(55),
}
"""The bounds at which five of the seven dimensions end, as printed."""


@pytest.mark.parametrize("seed", range(1, 11))
def test_the_papers_genetic_algorithm_beats_print_with_every_seed(seed):
    log = solved(PAPER, f"optimizer.seed={seed}")
    assert log.count == 8000
    assert best(log) <= ALLOWED < PRINTED


@pytest.mark.parametrize("method", ["hybrid", "gradient"])
def test_with_gradients_it_reaches_the_minimum(method):
    found = best(solved(PAPER, f"optimizer.method={method}", RIGID))
    assert found == pytest.approx(BEST, abs=1e-8)


def test_every_descent_ends_there():
    """There is one minimum, from wherever one starts: each descent ends on the ridge."""
    log = solved(PAPER, "optimizer.method=gradient", RIGID)
    ends = [log.outcome(slice(None)).objectives[step["kept"], 0].max() for step in log.steps]
    np.testing.assert_allclose(ends, BEST, atol=1e-8)


def test_the_initial_design_is_the_printed_one():
    assess = Assessor(problem(PAPER))
    assert assess(assess.problem.space.initial[None]).objectives[0, 0] == pytest.approx(2.840848, abs=5e-7)


def test_the_best_design_is_explained():
    found = optimize(problem(PAPER, "optimizer.method=hybrid"))
    values = variables_of(found.problem, found.genes)
    for path, bound in BOX.items():
        assert values[path] == pytest.approx(bound)
    bounds = {one.name: one.bound for one in found.influences}
    assert {path for path, bound in bounds.items() if bound} == BOX.keys()
    free = [path for path, bound in bounds.items() if not bound]
    assert free == ["geometry.passive_links.0", "geometry.passive_links.1"]
    (ridge,) = found.ridges
    assert list(ridge.names) == free
    gains = {one.name: one.gain for one in found.compliance_changes}
    assert gains["compliance_rx"] == pytest.approx(4.3376, rel=1e-4)
    assert gains["compliance_rz"] < 1e-6, "the paper's optimum gives up rotation about z"


def test_the_ridge_is_one():
    """All along it, also between its ends and at the designs of the reference, the sum stays the minimum."""
    found = optimize(problem(PAPER, "optimizer.method=hybrid", RIGID))
    space = found.problem.space
    (ridge,) = found.ridges
    ends = np.array([ridge.start, ridge.end]).T
    assert np.ptp(ends, axis=1).min() > 0.01, "it is centimetres long"
    on_it = [*ends.T, (0.6904, 0.5303), (0.6878, 0.5242)]
    genes = np.repeat(found.genes[None], len(on_it), axis=0)
    for row, lengths in zip(genes, on_it, strict=True):
        held = space.values(row)
        held[2:4] = lengths
        row[:] = space.genes(held)
    values = Assessor(found.problem)(genes).objectives[:, 0]
    np.testing.assert_allclose(values[:2], BEST, atol=1e-8)
    np.testing.assert_allclose(values[2:], BEST, atol=1e-6, err_msg="printed to 0.1 mm")


def test_no_random_design_is_better():
    """A hundred thousand here, ten million in benchmarks/optimisation.py."""
    genes = np.random.default_rng(0).random((100_000, 7))
    assert Assessor(problem(PAPER, RIGID))(genes).objectives.min() > BEST
