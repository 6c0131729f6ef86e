"""Machines and answers as values: pickled, compared, hashed, sent to other processes, not changed from outside."""

import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, is_dataclass, replace
from functools import cache
from multiprocessing import get_context

import numpy as np
import pytest
import xarray as xr

from kinetostat import (
    analyze,
    build,
    bundled,
    compare,
    evaluate,
    evaluate_grid,
    forward,
    guidelines,
    load,
    load_problem,
    optimize,
    register,
    requirements,
    sensitivity,
    workspace,
)
from kinetostat.studies.bundled import bundled_studies
from refusals import refused

OVER = ["x=-1 cm:1 cm:3", "y=-1 cm:1 cm:3"]
MACHINES = ("hexapod", "tripteron", "zhang-gosselin-4dof", "planar-3rpr")
SERIES = 'stiffness.actuator=["ball screw 200 N/um", "nut 300 N/um"]'


SMALL = ["optimizer.population=8", "optimizer.generations=2"]
ANSWERS = {
    "analysis": lambda: analyze(load("zhang-gosselin-4dof", ['load.force=["0 N","0 N","-500 N"]'])),
    "analysis out of reach": lambda: analyze(out_of_reach()),
    "sensitivity": lambda: sensitivity(load("zhang-gosselin-4dof")),
    "sensitivity out of reach": lambda: sensitivity(out_of_reach()),
    "guidelines": lambda: guidelines(load("zhang-gosselin-4dof"), OVER[0]),
    "assembly modes": lambda: forward(load("planar-3rpr"), starts=5),
    "comparison": lambda: compare({"one": load("zhang-gosselin-4dof"), "other": load("tripteron")}),
    "workspace": lambda: workspace(load("hexapod"), OVER, "stiffness_z > 1 N/um"),
    "verdicts": lambda: requirements(
        build(f'{bundled()["hexapod"]}\n[requirements.stiff]\ndemand = "stiffness_z > 1 N/um"\n')
    ),
    "problem": lambda: load_problem("zhang-gosselin-2002", SMALL),
    "result": lambda: optimize(load_problem("zhang-gosselin-2002", SMALL)),
}


def out_of_reach():
    return load("delta", ["pose.z=-30 m"])


@cache
def answer_of(name):
    return ANSWERS[name]()


def pickled(value):
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("name", bundled())
def test_a_machine_survives_pickling(name):
    machine = load(name)
    again = pickled(machine)
    assert again == machine
    assert hash(again) == hash(machine)
    assert (again.family, again.written) == (machine.family, machine.written)
    coordinate = next(iter(vars(machine.tables["pose"])))
    assert again != machine.with_values({f"pose.{coordinate}": getattr(machine.tables["pose"], coordinate) + 0.001})


def test_a_machine_with_parts_in_a_row_survives_pickling():
    machine = load("hexapod", [SERIES])
    assert pickled(machine) == machine != load("hexapod")


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_survives_pickling(name):
    answer = answer_of(name)
    again = pickled(answer)
    assert again == answer
    assert hash(again) == hash(answer)
    assert again != answer_of("problem" if name == "result" else "result")


def test_datasets_survive_pickling():
    for dataset in (evaluate_grid(load("hexapod"), OVER), evaluate(load("tripteron"), {"x": [0.1, 0.11]})):
        assert pickled(dataset).identical(dataset)


def test_answers_of_other_numbers_are_others():
    machine, other = load("hexapod"), load("hexapod", "z=0.16")
    assert analyze(machine) == analyze(machine) != analyze(other)
    assert len({machine, load("hexapod"), other}) == 2
    assert isinstance(workspace(machine, OVER).dataset, xr.Dataset)
    assert workspace(machine, OVER) == workspace(machine, OVER) != workspace(other, OVER)


def changeable(value, where, seen):
    """Places in an answer that could be changed from outside."""
    if id(value) in seen:
        return
    seen[id(value)] = value
    if type(value) in (list, dict, set) or (isinstance(value, np.ndarray) and value.flags.writeable):
        yield where
    if isinstance(value, xr.Dataset):
        yield from (f"{where}[{name}]" for name, array in value.data_vars.items() if array.values.flags.writeable)
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from changeable(entry, f"{where}[{key!r}]", seen)
    elif isinstance(value, list | tuple):
        for number, entry in enumerate(value):
            yield from changeable(entry, f"{where}[{number}]", seen)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            held = vars(value).get(field.name, getattr(value, field.name))  # small arrays are handed out as copies
            yield from changeable(held, f"{where}.{field.name}", seen)


@pytest.mark.parametrize("name", ANSWERS)
def test_nothing_in_an_answer_can_be_changed(name):
    assert not list(changeable(answer_of(name), name, {}))


def test_what_belongs_to_the_program_cannot_be_changed():
    machine = load("tripteron")
    assert not [place for name in MACHINES for place in changeable(load(name), name, {})]
    shared = (
        bundled(),
        bundled_studies(),
        machine.tables,
        machine.family.every_table,
        machine.family.literals["legs.z.slide"],
    )
    for mapping in shared:
        before = dict(mapping)
        for change in (
            mapping.clear,
            mapping.popitem,
            lambda m=mapping: m.update(x=1),
            lambda m=mapping: m.__ior__({}),
        ):
            with pytest.raises(TypeError, match=r"cannot be changed; copy it with dict\(\.\.\.\)"):
                change()
        assert mapping == before
    analysis = analyze(machine)
    with pytest.raises(TypeError, match=r"cannot be changed; copy it with np\.array\(\.\.\.\)"):
        analysis.stiffness[0][0] = 1.0


def test_a_family_must_be_registered_before_its_machines_are_pickled(monkeypatch):
    monkeypatch.setattr("kinetostat.machine.catalogue._REGISTERED", {})
    mine = replace(load("hexapod").family, name="my-hexapod")
    machine = replace(load("hexapod"), family=mine)
    with refused(r'"my-hexapod" cannot be pickled before it is registered'):
        pickle.dumps(machine)
    register(mine)
    machine = build(bundled()["hexapod"].replace('family = "hexapod"', 'family = "my-hexapod"'))
    data = pickle.dumps(machine)
    assert pickle.loads(data) == machine
    monkeypatch.setattr("kinetostat.machine.catalogue._REGISTERED", {})
    with refused(r'"my-hexapod" is not known in this program; register it'):
        pickle.loads(data)


@pytest.mark.slow
def test_machines_go_to_spawned_processes_and_answers_come_back():
    machines = [load(name) for name in MACHINES] + [load("hexapod", [SERIES])]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        assert list(pool.map(analyze, machines)) == [analyze(machine) for machine in machines]
