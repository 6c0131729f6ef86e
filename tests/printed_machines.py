"""Bundled machines that have programs of their own, some with rigid and free springs, and random poses of them."""

import numpy as np

from kinetostat import load
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.machine_functions import ENTRIES
from kinetostat.engine.points import PointTable
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values, with_values


def printable():
    """The names of the bundled machines whose legs have closed forms."""
    machines = {name: load(name) for name in bundled()}
    return [name for name, m in machines.items() if m.family.chains is None or closes_inside(m)]


LOADED = ["load.state=loaded", "load.force.2=-400 N", "limits.actuator_force=1 kN"]
EXACT = {
    "hexapod, rigid": ("hexapod", ["stiffness.actuator=rigid"]),
    "hexapod, one rigid and one free": ("hexapod", ["stiffness.actuator.0=rigid", "stiffness.actuator.3=0"]),
    "delta, one rigid": ("delta", ["stiffness.actuator.1=rigid"]),
    "zhang-gosselin-4dof, rigid links": ("zhang-gosselin-4dof", ["stiffness.passive_links.1=rigid"]),
    "hexapod, meant under load": ("hexapod", LOADED),
}
"""Machines with exactly rigid or free springs, and one whose limits judge its loads, by what a test calls them."""
MACHINES = {name: (name, []) for name in printable()} | EXACT


def machine_of(label: str) -> Machine:
    """The machine that a test calls so."""
    name, settings = MACHINES[label]
    return load(name, settings)


def poses_of(machine, count, spread, seed=0):
    """Coordinates of random poses [n x coordinates], and the same as points by leaf path."""
    known = {path: float(value) for path, value in values(machine).items() if path.startswith("pose.")}
    chains = machine.family.chains
    length = float(machine.chains().length if chains else machine.configure().length)
    angle = {leaf: p.quantity.kind == "angle" for p in parameters(machine.family) for leaf in p.leaves}
    units = [1.0 if angle[path] else length for path in known]
    drawn = spread * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(known)))
    rows = np.array([*known.values()]) + drawn * units
    return rows, PointTable(dict(zip(known, np.ascontiguousarray(rows.T), strict=True)))


def entries_by_python(machine, points):
    """Statuses [n], and the entries of C and K [n x 42], by plain Python pose by pose."""
    rows = np.stack([*points.columns(0, points.size).values()], axis=1)
    codes, entries = [], []
    for row in rows.tolist():
        response = respond(with_values(machine, dict(zip(points.paths, row, strict=True))))
        codes.append(int(response.status))
        entries.append([float(QUANTITIES[name].value(response)) for name in ENTRIES])
    return np.array(codes), np.array(entries)


def worst_difference(found, expected):
    """The largest difference of entries [n x 42], as a share of the root of the diagonal ones in their row and column.

    Beside a diagonal entry that is infinite or zero, it is a share of the largest such entry at any of the poses.
    What is infinite or NaN must be the same.
    """
    result, pairs = 0.0, [(i, j) for i in range(6) for j in range(i, 6)]
    for first in (0, 21):
        diagonal = {i: np.abs(expected[:, first + pairs.index((i, i))]) for i in range(6)}
        for k, (i, j) in enumerate(pairs, first):
            finite = np.isfinite(expected[:, k])
            assert np.array_equal(found[~finite, k], expected[~finite, k], equal_nan=True)
            scale = np.sqrt(diagonal[i] * diagonal[j])[finite]
            scale = np.where(np.isfinite(scale) & (scale > 0.0), scale, np.abs(expected[finite, k]).max(initial=1e-300))
            result = max(result, float((np.abs(found[finite, k] - expected[finite, k]) / scale).max(initial=0.0)))
    return result
