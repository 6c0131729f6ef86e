"""A batch in chunks gives the bits of the batch as a whole, whatever the size of chunks."""

from itertools import pairwise

import numpy as np
import pytest

from kinetostat.engine import batch, chunks
from kinetostat.engine.batch import evaluate
from kinetostat.engine.chunks import Work, in_chunks, in_this_process
from kinetostat.engine.points import Axis, Grid
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import parameters, values
from machines import one_of_each

SLAB = 64
NAMES = ("compliance_x", "stiffness_x", "singularity_margin")


@pytest.fixture
def small_slabs(monkeypatch):
    monkeypatch.setattr(batch, "NATIVE_SLAB", SLAB)
    monkeypatch.setattr(chunks, "NATIVE_SLAB", SLAB)


def stiff_paths(machine):
    return {path for p in parameters(machine.family) if p.quantity.stiff for path in p.leaves}


def grid_around(case):
    """A grid over three parameters of a machine, a spring that is free at one end among them."""
    machine = case.machine
    spring = next(path for path in values(machine) if path in stiff_paths(machine))
    poses = [path for path in case.ranges if path.startswith("pose.")][:2]
    axes = [Axis((spring,), np.array([0.0, 1e4, 1e6]))]
    axes += [Axis((path,), np.linspace(*case.ranges[path], n)) for path, n in zip(poses, (11, 13), strict=True)]
    return machine, Grid(axes)


@one_of_each
def test_chunks_of_any_size_give_the_same_bits(case, small_slabs):
    machine, grid = grid_around(case)
    names = [name for name in NAMES if name.split("_")[-1] in (*machine.family.component_names, "singularity_margin")]
    whole = evaluate(machine, grid, names)
    for slabs in (1, 3):
        work = Work(machine, grid, tuple(names), slabs * SLAB)
        found = dict(in_this_process(work, range(work.count)))
        assert sorted(found) == list(range(work.count))
        parts = [found[number] for number in range(work.count)]
        np.testing.assert_array_equal(np.concatenate([part.status for part in parts]), whole.status)
        for name in names:
            joined = np.concatenate([part.values[name] for part in parts])
            assert joined.tobytes() == whole.values[name].tobytes()


def test_chunks_cover_every_point_once():
    machine = load("zhang-gosselin-4dof")
    grid = Grid([Axis(("pose.x",), np.arange(1000.0)), Axis(("pose.z",), np.arange(3001.0))])
    work = in_chunks(machine, grid, ["compliance_x", "compliance_z"])
    parts = [work.part(number) for number in range(work.count)]
    assert parts[0].start == 0
    assert parts[-1].stop == grid.size
    assert all(one.stop == other.start for one, other in pairwise(parts))
    assert all(part.start % batch.NATIVE_SLAB == 0 for part in parts)
    assert work.count > 4


def test_many_quantities_still_leave_a_chunk_of_one_slab():
    work = in_chunks(load("hexapod"), Grid([Axis(("pose.x",), np.arange(9.0))]), [f"q{i}" for i in range(100)])
    assert work.chunk == batch.NATIVE_SLAB
