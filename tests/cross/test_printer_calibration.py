"""A delta printer calibrated by ten probed heights: truth within its intervals, and what each firmware then does.

Kinematics of the printer and of the controllers are written in tests, from their points and documents.
"""

from dataclasses import replace

import numpy as np
import pytest

from kinetostat import build, identify, load
from kinetostat.accuracy.model import error_model
from kinetostat.exchange.leg_by_leg import document_of
from kinetostat.spec.errors import InputError
from kinetostat.studies.identification.fit import FitOptions, best_fit
from kinetostat.studies.identification.fitted_values import firmware_numbers, klipper_text, marlin_text, reprap_text
from kinetostat.studies.identification.identification import PREFERENCE, _sizes_by_name, identification_of
from kinetostat.studies.identification.measurements import Sigmas, read_measurements
from synthetic_printer import (
    ANGLES,
    ENDSTOPS,
    PROBED,
    Truth,
    commanded,
    endstops,
    firmware_truth,
    probed_heights,
    reached,
    sent_height,
    write_probes,
)

NOISE = 20e-6
TIES = {"radius": "geometry.tower_radius.*", "rod": "geometry.rod_length.*"}
FITTED = ("zeros", "geometry.tower_angles.0", "geometry.tower_angles.1")
PRIORS = {
    "zeros": "0.3 mm", "geometry.tower_angles.*": "4 mrad", "radius": "0.3 mm", "rod": "0.3 mm",
    "geometry.lean_*": "2 mrad", "scale": "0.001",
}  # fmt: skip


def somewhere(draw, wide=False):
    """Errors as large as the priors say; with leans and a scale if `wide`."""
    truth = Truth(draw.normal(0, 3e-4, 3), np.array([*draw.normal(0, 4e-3, 2), 0.0]), *draw.normal(0, 3e-4, 2))
    if wide:
        truth.lean_out, truth.lean_aside, truth.gain = (
            draw.normal(0, 2e-3, 3),
            draw.normal(0, 2e-3, 3),
            draw.normal(0, 1e-3),
        )
    return truth


def numbers_of(truth):
    """By the paths of the unknowns."""
    result = {f"legs.tower {t}.actuator.zero": z for t, z in zip("ABC", truth.zeros, strict=True)}
    for name in ("lean_out", "lean_aside"):
        result |= {f"geometry.{name}.{i}": value for i, value in enumerate(getattr(truth, name))}
    result |= {f"geometry.tower_angles.{i}": value for i, value in enumerate(truth.angles)}
    return result | {"radius": truth.radius, "rod": truth.rod, "scale": truth.gain}


@pytest.fixture(scope="module")
def machine():
    return load("delta-linear")


CASES = [("", True), ("", False), ("priors", True), ("priors", False), ("wide", True), ("wide", False)]
"""Whether seven numbers are fitted, with or without priors, or fourteen; and whether the probe's sigma is known."""


WIDE, NARROW = PRIORS, {name: size for name, size in PRIORS.items() if name not in ("geometry.lean_*", "scale")}


def fit_of(machine, path, truth, what, known, draw):
    """Fit a printer to ten heights with noise."""
    write_probes(path, probed_heights(truth))
    data = read_measurements(machine, path, Sigmas(NOISE if known else 1e-5, 1e-4, known))
    data = replace(data, values={"z": draw.normal(0.0, NOISE, len(PROBED))})
    model = error_model(machine, data.pose, len(data), np.zeros(6))
    ties = TIES | ({"scale": "legs.*.gain"} if what == "wide" else {})
    fitted = (*FITTED, "geometry.lean_*") if what == "wide" else FITTED
    priors = {"": {}, "priors": NARROW, "wide": WIDE}[what]
    return identification_of(model, data, fitted, priors=priors, ties=ties, robust=False)


def hits(answer, truth):
    """Of each firmware number that is sure to some size, whether its interval holds the true one."""
    found, result = firmware_numbers(answer), []
    for name, true in firmware_truth(truth).items():
        pairs = zip(np.atleast_1d(getattr(found, name)), true, found.halves[name], strict=True)
        result += [abs(size - value) <= half for size, value, half in pairs if half > 0.0]
    return result


class Linear:
    """Residuals of a printer with small errors, so that hundreds of printers take no time."""

    def __init__(self, rates, truth, noise):
        self.rates, self.truth, self.noise = rates, truth, noise

    def residuals(self, values):
        return self.noise + self.rates @ (self.truth - values)

    def linearisation(self, values):
        return self.residuals(values), self.rates


def repeated(machine, folder, what, known, draw):
    """A fit to ten heights, and the options with which it is repeated for other printers."""
    base = fit_of(machine, folder / "probes.csv", Truth(), what, known, draw)
    before = _sizes_by_name(base.unknowns, {"": {}, "priors": NARROW, "wide": WIDE}[what], "prior")
    weak = np.full(len(before), PREFERENCE)
    return base, FitOptions(base.sizes, before, np.full(len(before), np.inf), weak, False, known)


def true_values(base, truth):
    paths = numbers_of(truth)
    return np.array([paths[unknown.path] for unknown in base.unknowns])


@pytest.mark.slow
@pytest.mark.parametrize(("what", "known"), CASES)
def test_truth_is_within_its_intervals_and_residuals_are_those_of_the_noise(machine, tmp_path, what, known):
    """In 95 % of 200 repetitions with other errors and noise, and to a tenth, whatever priors say and use up."""
    draw, sigma = np.random.default_rng(3), NOISE if known else 1e-5
    base, options = repeated(machine, tmp_path, what, known, draw)
    rates = base.observed.linearisation(np.zeros(len(base.unknowns)))[1]
    inside, ratios = [], []
    for _ in range(200):
        true = true_values(base, somewhere(draw, what == "wide"))
        noise = draw.normal(0.0, NOISE / sigma, len(PROBED))
        fit = best_fit(Linear(rates, true, noise), base.observed.row_poses, options)
        answer = replace(base, fit=fit)
        ratios.append((fit.scatter * sigma / NOISE) ** 2)
        inside += [abs(a - b) <= half for a, b, half in zip(fit.values, true, fit.half_intervals, strict=True)]
        linear = firmware_numbers(replace(answer, fit=replace(fit, values=true)))
        numbers = firmware_numbers(answer)
        for name in ("radius", "rods", "angles", "raised"):
            parts = (np.atleast_1d(getattr(each, name)) for each in (numbers, linear))
            inside += [abs(a - b) <= h for a, b, h in zip(*parts, numbers.halves[name], strict=True) if h > 0.0]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.025)
    # Every printer counts once: where sigma is estimated, freedoms grow with it, and weights would choose great ones.
    assert np.sqrt(np.mean(ratios)) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_fourteen_numbers_of_exact_printers_leave_residuals_of_the_noise(machine, tmp_path, known):
    """200 printers with the kinematics of the tests: the nozzle is sent to the same ten places of the bed each time."""
    draw, sigma = np.random.default_rng(17), NOISE if known else 1e-5
    base, options = repeated(machine, tmp_path, "wide", known, draw)
    inside, ratios = [], []
    for _ in range(200):
        truth = somewhere(draw, wide=True)
        places = [np.array([x, y, height]) for (x, y), height in zip(PROBED, probed_heights(Truth()), strict=True)]
        heights = [reached(commanded(place), truth, place)[2] for place in places]
        observed = replace(base.observed, measured=np.array(heights) + draw.normal(0.0, NOISE, len(PROBED)))
        fit = best_fit(observed, observed.row_poses, options)
        ratios.append((fit.scatter * sigma / NOISE) ** 2)
        inside += (np.abs(fit.values - true_values(base, truth)) <= fit.half_intervals).tolist()
    assert np.mean(inside) == pytest.approx(0.95, abs=0.025)
    assert np.sqrt(np.mean(ratios)) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("values", [10, 30])
def test_freedoms_are_the_mean_sum_of_squares_over_machines_as_the_priors_say(values):
    """Theory, section 15, with fourteen unknowns; for one machine, the mean over noise is another number.

    A sum of squares is a quadratic form, whose mean over independent numbers is that over two points on each axis.
    """
    draw, count = np.random.default_rng(4), 14
    rates, priors = draw.normal(size=(values, count)), np.exp(draw.normal(size=count))
    options = FitOptions(np.ones(count), priors, np.full(count, np.inf), np.full(count, 1e-6), robust=False)

    def squares(truth, noise):
        fit = best_fit(Linear(rates, truth, noise), np.arange(values), options)
        return float(fit.after @ fit.after), fit.freedom

    axes = values + count
    points = np.sqrt(axes) * np.concatenate([np.eye(axes), -np.eye(axes)])
    sums, freedoms = zip(*(squares(priors * point[values:], point[:values]) for point in points), strict=True)
    hat = rates @ np.linalg.solve(rates.T @ rates + np.diag(priors**-2.0), rates.T)
    left = np.eye(values) - hat
    assert freedoms == pytest.approx([np.trace(left)] * len(points))
    assert np.mean(sums) == pytest.approx(np.trace(left), rel=1e-6)
    truth = 2.0 * priors
    points = np.sqrt(values) * np.concatenate([np.eye(values), -np.eye(values)])
    mean = np.mean([squares(truth, noise)[0] for noise in points])
    assert mean == pytest.approx(np.trace(left @ left) + np.sum((left @ rates @ truth) ** 2), rel=1e-6)
    assert mean > 1.2 * np.trace(left) or values > count


@pytest.mark.parametrize("what", ["", "priors", "wide"])
def test_exact_printers_are_found_within_their_intervals(machine, tmp_path, what):
    draw, inside = np.random.default_rng(5), []
    for _ in range(4):
        truth = somewhere(draw, what == "wide")
        inside += hits(fit_of(machine, tmp_path / "probes.csv", truth, what, True, draw), truth)
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("named", ["zeros", "angles", "radius", "rod", "lean_out", "lean_aside", "gain"])
def test_each_error_moves_the_nozzle_as_the_kinematics_of_the_tests_say(machine, tmp_path, named):
    """Also by leans, which turn a tower about its foot on the bed, from where its carriage counts."""
    base, _ = repeated(machine, tmp_path, "wide", True, np.random.default_rng(1))
    sizes = {"radius": 3e-5, "rod": 3e-5, "gain": 1e-4}
    truth = replace(Truth(), **{named: sizes.get(named, np.array([2e-5, -1e-5, 0.0]))})
    places = [np.array([x, y, height]) for (x, y), height in zip(PROBED, probed_heights(Truth()), strict=True)]
    heights = np.array([reached(commanded(place), truth, place)[2] for place in places])
    left = replace(base.observed, measured=heights).residuals(true_values(base, truth))
    assert np.abs(heights).max() > 1e-7
    assert left == pytest.approx(np.zeros(10), abs=1e-9 / NOISE)  # a nanometre, of the second order


def test_a_printer_without_noise_gives_its_numbers_and_firmware_that_prints_flat(machine, tmp_path):
    """Each controller is simulated with the numbers that it is given, over a printer that is as it was."""
    truth = Truth(np.array([3e-4, -2e-4, 4e-4]), np.array([0.004, -0.003, 0.0]), 5e-4, 3e-4)
    write_probes(tmp_path / "probes.csv", probed_heights(truth))
    answer = identify(machine, tmp_path / "probes.csv", FITTED, ties=TIES, sigma="1 um")
    numbers = firmware_numbers(answer)
    for name, true in firmware_truth(truth).items():
        assert np.atleast_1d(getattr(numbers, name)) == pytest.approx(true, abs=2e-3), name
    triggers = endstops(truth)
    radius, rods, angles = numbers.radius / 1e3, np.array(numbers.rods) / 1e3, ANGLES + np.radians(numbers.angles)
    own = np.sqrt(rods**2 - radius**2)
    marlin, marlin_height = numbers.marlin_endstops
    reprap, reprap_height = numbers.reprap_endstops
    homes = {
        "klipper": (ENDSTOPS + np.array(numbers.raised) / 1e3 + own, triggers),
        "marlin": (ENDSTOPS + marlin_height / 1e3 + own, triggers + np.array(marlin) / 1e3),
        "reprapfirmware": (ENDSTOPS + reprap_height / 1e3 + own + np.array(reprap) / 1e3, triggers),
    }
    for firmware, (believed, true) in homes.items():
        heights = [sent_height(truth, (radius, rods, angles), believed, true, place) for place in PROBED]
        assert np.abs(heights).max() < 1e-6, firmware
    assert max(marlin) == 0.0
    assert sum(reprap) == pytest.approx(0.0, abs=1e-12)


def test_files_of_firmware_have_the_numbers(machine, tmp_path):
    truth = Truth(np.array([3e-4, -2e-4, 4e-4]), np.array([0.004, -0.003, 0.0]), 5e-4, 3e-4)
    write_probes(tmp_path / "probes.csv", probed_heights(truth))
    numbers = firmware_numbers(identify(machine, tmp_path / "probes.csv", FITTED, ties=TIES, sigma="1 um"))
    assert "delta_radius: 106.1000" in klipper_text(numbers)
    assert "angle: 210.22" in klipper_text(numbers)
    assert "R106.1000" in marlin_text(numbers)
    assert "M665 L215.2" in reprap_text(numbers)


def test_few_values_need_priors_and_ties_need_paths(machine, tmp_path):
    path = tmp_path / "probes.csv"
    write_probes(path, probed_heights(Truth()))
    with pytest.raises(InputError, match="10 poses give 10 measured values for 63 unknowns"):
        identify(machine, path)
    priors = {"geometry": "0.1 mm", "zeros": "0.2 mm", "legs.*.r*": "1 mrad"}
    assert identify(machine, path, priors=priors, sigma="20 um").fit.freedom > 2.0
    with pytest.raises(InputError, match='the tie rod: "rods" names no error'):
        identify(machine, path, (), ties={"rod": "rods"})
    with pytest.raises(InputError, match="errors of several kinds"):
        identify(machine, path, (), ties={"all": "geometry.*"})


def test_legs_written_one_by_one_are_tied_as_families_are(tmp_path):
    """A printer leg by leg, and the same of a family: one rod length and one way of all zeros are the same numbers."""
    family = load("delta-linear")
    own = build(document_of(family))
    found = []
    for machine in (family, own):
        write_probes(tmp_path / "probes.csv", probed_heights(Truth(np.full(3, 2e-4), rod=3e-4)))
        ties = {"rod": "legs.*.length", "zero": "legs.*.zero"}
        answer = identify(machine, tmp_path / "probes.csv", (), ties=ties, sigma="1 um", robust=False)
        found.append(answer.fit.values)
    assert found[0] == pytest.approx(found[1], abs=1e-7)
