"""What an instrument would measure of a machine whose errors are known."""

import numpy as np

from kinetostat.accuracy.model import error_model
from kinetostat.machine.parameters import parameters, values
from kinetostat.numerics.motions import Motions, exponential, logarithm
from kinetostat.studies.identification.measurements import POSITION, ROTATION, Measurements

SIGMA = dict.fromkeys(POSITION, 5e-6) | dict.fromkeys(ROTATION, 3e-5)


def posed(machine, count, turn=0.12, share=0.08, seed=3):
    """A model at poses around that of a machine."""
    rng, given = np.random.default_rng(seed), values(machine)
    length = float((machine.chains() if machine.family.chains else machine.configure()).length)
    spans = {p.path: turn if p.quantity.kind == "angle" else share * length for p in parameters(machine.family)}
    poses = {path: given[path] + rng.uniform(-s, s, count) for path, s in spans.items() if path.startswith("pose.")}
    return error_model(machine, poses, count, np.zeros(6)), poses


def measured(model, poses, truth, names=(*POSITION, *ROTATION), rng=None, frame=None):
    """What an instrument would measure, with noise."""
    rng, count = rng or np.random.default_rng(5), len(model)
    moved, _ = model.displacement(truth)
    turned = exponential(np.concatenate([moved[:, :3], 0.0 * moved[:, :3]], axis=1)).rotation @ model.drawn.axes
    place = Motions(turned, model.drawn.tool + moved[:, 3:])
    place = place if frame is None else frame.inverse() @ place
    angles = logarithm(Motions(place.rotation, np.zeros((count, 3))))[:, :3]
    true = dict(zip((*POSITION, *ROTATION), (*place.translation.T, *angles.T), strict=True))
    noisy = {name: true[name] + SIGMA[name] * rng.normal(size=count) for name in names}
    sigma = {name: np.full(count, SIGMA[name]) for name in names}
    empty = np.full((count, 3), np.nan)
    return Measurements("data.csv", tuple(range(2, count + 2)), poses, noisy, sigma, np.zeros((count, 6)), empty)


def truth_of(model, groups=("geometry", "zeros"), size=2e-4, seed=9):
    rng = np.random.default_rng(seed)
    return np.array([size * rng.normal() if error.group in groups else 0.0 for error in model.errors])


def found(answer, truth):
    """How far identified values lie from the truth, in halves of their 95 % intervals, of those that are seen."""
    halves = answer.fit.half_intervals
    numbers = [n for n, place in enumerate(answer.observed.error_numbers) if place >= 0 and np.isfinite(halves[n])]
    true = truth[answer.observed.error_numbers[numbers]]
    return (answer.fit.values[numbers] - true) / halves[numbers]


def written(path, data):
    """A CSV file of measurements."""
    columns = {
        name.removeprefix("pose."): (1e3 if name[5:] in "xyz" else np.degrees(1.0)) * v for name, v in data.pose.items()
    }
    heads = [f"{name} [{'mm' if name in 'xyz' else 'deg'}]" for name in columns]
    units = {name: "mm" if name in POSITION else "mrad" for name in data.values}
    heads += [f"measured.{name} [{unit}]" for name, unit in units.items()]
    table = np.column_stack([*columns.values(), *(1e3 * v for v in data.values.values())])
    lines = [", ".join(heads), *(", ".join(f"{v:.9f}" for v in row) for row in table)]
    path.write_text("\n".join(lines) + "\n")
