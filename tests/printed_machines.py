"""Bundled machines that have programs of their own, some with rigid and free springs, and random poses of them."""

import numpy as np

from kinetostat import load
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import ENTRIES, QUANTITIES
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
    """Statuses [n], and the entries of C and K [n x 42], NaN where the status is not OK: by plain Python.

    The formulas take all poses at once as NumPy arrays, and every twentieth pose as floats too: the same to 1e-12.
    """
    columns = points.columns(0, points.size)
    with np.errstate(all="ignore"):
        codes, entries = _codes_and_entries(machine, columns)
    every = slice(None, None, 20)
    rows = np.stack([*columns.values()], axis=1)[every].tolist()
    alone = [_codes_and_entries(machine, dict(zip(columns, row, strict=True))) for row in rows]
    codes = np.broadcast_to(codes, points.size).astype(int)
    entries = np.stack([np.broadcast_to(entry, points.size) for entry in entries], axis=1)
    assert np.array_equal(codes[every], [code for code, _ in alone])
    ok = codes[every] == Status.OK
    assert worst_difference(entries[every][ok], np.array([row for _, row in alone], dtype=float)[ok]) < 1e-12
    return codes, np.where(codes[:, None] == Status.OK, entries, np.nan)


def _codes_and_entries(machine, numbers):
    """The status of the machine with these numbers, and the entries of C and K, of the kind that the numbers are."""
    response = respond(with_values(machine, numbers))
    return response.status, [QUANTITIES[name].value(response) for name in ENTRIES]


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
