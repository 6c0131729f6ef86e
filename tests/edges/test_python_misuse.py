"""Misuses of the Python interface: each is refused in a sentence that names the argument, none ends in a raw exception.

A row is the name that the message must contain, and the call. What Python itself refuses so (attributes, keys) is left.
"""

import inspect
import pickle
from functools import cache

import numpy as np
import pytest

import kinetostat
from kinetostat import (
    Machine,
    Status,
    analyze,
    build,
    bundled,
    changed,
    compare,
    evaluate,
    evaluate_grid,
    export,
    forward,
    guidelines,
    load,
    load_problem,
    machine_picture,
    optimize,
    plot,
    register,
    report,
    reproduce,
    requirements,
    save,
    sensitivity,
    validate,
    workspace,
)
from kinetostat.spec.arguments import words_of
from refusals import refused

H = load("hexapod")
A = analyze(H)
OVER = ["x=-1 cm:1 cm:3", "y=-1 cm:1 cm:3"]
SIZE = (64, 64)
HEAD = {"schema": 1, "name": "a", "family": "hexapod"}


@cache
def problem():
    return load_problem("zhang-gosselin-2002", ["optimizer.population=8", "optimizer.generations=2"])


class Odd:
    """Nothing that anybody expects."""


MISUSES = [
    ("machine", lambda: load()),
    ("machine", lambda: load(None)),
    ("machine", lambda: load(3)),
    ("machine", lambda: load(["hexapod"])),
    ("machine", lambda: load(b"hexapod")),
    ("machine", lambda: load(H)),
    ("folder", lambda: load(".")),
    ("settings", lambda: load("hexapod", None)),
    ("settings", lambda: load("hexapod", 3)),
    ("settings", lambda: load("hexapod", {"x": 1})),
    (r"settings\[1\]", lambda: load("hexapod", ["x=0", 3])),
    (r"settings\[0\]", lambda: load("hexapod", [["x=1"]])),
    (r"settings\[0\]", lambda: load("hexapod", [b"x=1"])),
    (r"settings\[0\]", lambda: load("hexapod", (3 for _ in "a"))),
    ("set", lambda: load("hexapod", set=["x=1"])),
    ("too many", lambda: load("hexapod", [], 3)),
    ("document", lambda: build(None)),
    ("document", lambda: build([])),
    ("document", lambda: build(b"family = 'hexapod'")),
    ("document", lambda: build(H)),
    ("key of document", lambda: build({1: 2})),
    ("family", lambda: build({})),
    ("family", lambda: build({"family": 3})),
    ("geometry", lambda: build({**HEAD, "geometry": 3})),
    ("base_radius", lambda: build({**HEAD, "geometry": {"base_radius": Odd()}})),
    ("name", lambda: build({**HEAD, "name": None})),
    ("display", lambda: build({**HEAD, "display": 3})),
    ("requirements", lambda: build({**HEAD, "requirements": 3})),
    ("legs", lambda: build({**HEAD, "family": "legs", "legs": 3})),
    ("origin", lambda: build(bundled()["hexapod"], 3)),
    ("settings", lambda: build(bundled()["hexapod"], "a", None)),
    ("too many", lambda: bundled(3)),
    ("machine", lambda: changed(None, {})),
    ("values", lambda: changed(H)),
    ("values", lambda: changed(H, None)),
    ("values", lambda: changed(H, [1])),
    ("key of values", lambda: changed(H, {3: 1})),
    (r"values\['x'\]", lambda: changed(H, {"x": None})),
    (r"values\['x'\]", lambda: changed(H, {"x": Odd()})),
    (r"values\['x'\]", lambda: changed(H, {"x": b"1"})),
    (r"values\['x'\]", lambda: changed(H, {"x": 1j})),
    (r"values\['base_angles'\]", lambda: changed(H, {"base_angles": {1, 2, 3, 4, 5, 6}})),
    (r"geometry\.base_angles\.0", lambda: changed(H, {"base_angles": np.zeros((6, 1))})),
    ("x", lambda: changed(H, x=1)),
    ("values", lambda: H.with_values("x=1")),
    ("x", lambda: H.with_values(x=Odd())),
    ("units", lambda: H.in_units(["mm"])),
    ("machine", lambda: analyze([H])),
    ("machine", lambda: analyze(A)),
    ("axes", lambda: analyze(H, None)),
    ("axis; did you mean axes", lambda: analyze(H, axis="base")),
    ("direction", lambda: A.along(None)),
    ("direction", lambda: A.along("z")),
    ("direction", lambda: A.along([1, 2])),
    (r"direction\[0\]", lambda: A.along([[0, 0, 1]])),
    ("component", lambda: A.shares_of([])),
    ("matrix", lambda: A.shares_of("x", None)),
    ("which", lambda: A.to_pandas(3)),
    ("machine", lambda: evaluate(None, {"x": [0]})),
    ("poses", lambda: evaluate(H)),
    ("poses", lambda: evaluate(H, None)),
    ("poses", lambda: evaluate(H, [[1], [1, 2]])),
    ("poses", lambda: evaluate(H, (i for i in range(3)))),
    ("poses", lambda: evaluate(H, {"x": [Odd()]})),
    ("CSV", lambda: evaluate(H, ".")),
    ("quantities", lambda: evaluate(H, {"x": [0]}, None)),
    (r"quantities\[0\]", lambda: evaluate(H, {"x": [0]}, [3])),
    ("quantities", lambda: evaluate(H, {"x": [0]}, {"K": 1})),
    ("stifness", lambda: evaluate(H, {"x": [0]}, "stifness")),
    ("progress", lambda: evaluate(H, {"x": [0]}, progress=3)),
    ("machine", lambda: evaluate_grid("hexapod", OVER)),
    ("ranges", lambda: evaluate_grid(H)),
    ("ranges", lambda: evaluate_grid(H, None)),
    ("ranges", lambda: evaluate_grid(H, {"x": (0, 1, 3)})),
    (r"ranges\[0\]", lambda: evaluate_grid(H, [("x", 0, 1, 3)])),
    ("ranges", lambda: evaluate_grid(H, b"x=0:1:3")),
    ("quantity; did you mean quantities", lambda: evaluate_grid(H, OVER, quantity="compliance_x")),
    ("ranges", lambda: workspace(H, None)),
    (r"conditions\[0\]", lambda: workspace(H, OVER, [3])),
    ("conditions", lambda: workspace(H, OVER, None)),
    ("seed", lambda: workspace(H, OVER, seed=None)),
    ("seed", lambda: workspace(H, OVER, seed=-1)),
    ("seed", lambda: workspace(H, OVER, seed=1.5)),
    ("seed", lambda: workspace(H, OVER, seed=True)),
    ("quantities", lambda: sensitivity(H, None)),
    ("quantities", lambda: sensitivity(H, [])),
    ("ranges", lambda: guidelines(H, 3)),
    ("actuators", lambda: forward(H, [1.0])),
    ("actuators", lambda: forward(H, {"leg 1": None})),
    ("starts", lambda: forward(H, starts=1.5)),
    ("spread", lambda: forward(H, spread="wide")),
    ("designs", lambda: compare(None)),
    ("designs", lambda: compare(H)),
    (r"designs\[1\]", lambda: compare([H, 3])),
    ("key of designs", lambda: compare({1: H, 2: H})),
    ("designs", lambda: compare({"hexapod", "delta"})),
    ("ranges", lambda: compare([H, H], 3)),
    ("study", lambda: load_problem(None)),
    ("study", lambda: load_problem(H)),
    ("problem", lambda: optimize("zhang-gosselin-2002")),
    ("problem", lambda: optimize(H)),
    ("folder", lambda: optimize(problem(), 3)),
    ("in the place of a folder", lambda: optimize(problem(), "f.csv")),
    ("resume", lambda: optimize(problem(), resume=True)),
    ("stop", lambda: optimize(problem(), stop=True)),
    ("watch", lambda: optimize(problem(), watch="yes")),
    ("engine", lambda: validate(H, ["exudyn"])),
    ("progress", lambda: reproduce(3)),
    ("machine", lambda: machine_picture("hexapod")),
    ("size", lambda: machine_picture(H, None)),
    ("size", lambda: machine_picture(H, (1, 2, 3))),
    (r"size\[0\]", lambda: machine_picture(H, (100.5, 100))),
    (r"view\[0\]", lambda: machine_picture(H, SIZE, ["a", "b", "c"])),
    ("theme", lambda: machine_picture(H, SIZE, theme=3)),
    ("hidden", lambda: machine_picture(H, SIZE, hidden=None)),
    ("transparent", lambda: machine_picture(H, SIZE, transparent="no")),
    ("NoneType", lambda: plot(None)),
    ("which", lambda: plot(H, ["views"])),
    ("path", lambda: save(A, None)),
    ("path", lambda: save("a.json", A)),
    ("suffix", lambda: save(A, "")),
    ("family", lambda: register(Machine)),
    ("machine", lambda: requirements([H])),
    ("about", lambda: report(A, "a.html")),
    ("path", lambda: report(H, 3)),
    ("ranges", lambda: report(H, "a.html", 3)),
    ("without", lambda: report(H, "a.html", without=3)),
    ("author", lambda: report(H, "a.html", author=3)),
    ("date", lambda: report(H, "a.html", date=20260101)),
    ("machine", lambda: export("hexapod", "a.xml")),
    ("path", lambda: export(H, 3)),
    ("to", lambda: export(H, "a.xml", ["mjcf"])),
    ("status 99", lambda: Status(99)),
]


@pytest.mark.parametrize(("name", "misuse"), MISUSES, ids=[str(number) for number in range(len(MISUSES))])
def test_a_misuse_is_refused_by_the_name_of_the_argument(name, misuse, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.csv").touch()
    with refused(rf"(^|\W){name}\W") as caught:
        misuse()
    assert str(caught.value).isprintable()
    assert caught.value.__cause__ is None
    assert [path.name for path in tmp_path.iterdir()] == ["f.csv"]


def test_what_may_be_given_in_several_ways_is_taken():
    whole = evaluate_grid(H, OVER)
    for ranges in (tuple(OVER), (text for text in OVER), np.array(OVER)):
        assert evaluate_grid(H, ranges).identical(whole)
    assert workspace(H, OVER, seed=np.int64(3)) == workspace(H, OVER, seed=3)
    assert A.along(np.array([0, 0, 1])) == A.along((0, 0, 1.0))
    assert [design.label for design in compare({"a": "hexapod", "b": H}).designs] == ["a", "b"]
    assert compare(machine for machine in (H, H)) == compare([H, H])


FUNCTIONS = [(name, value) for name in kinetostat.__all__ if inspect.isfunction(value := getattr(kinetostat, name))]


@pytest.mark.parametrize(("name", "function"), FUNCTIONS, ids=[name for name, _ in FUNCTIONS])
def test_every_argument_has_words_and_the_function_keeps_its_signature(name, function):
    assert pickle.loads(pickle.dumps(function)) is function
    plain = inspect.unwrap(function)
    assert plain is not function
    assert (inspect.signature(function), function.__doc__, function.__name__) == (
        inspect.signature(plain), plain.__doc__, name
    )  # fmt: skip
    free = ("answer", "what", "poses", "theme")
    assert all(
        words_of(p) or p.name in free for p in inspect.signature(function).parameters.values() if p.name not in free
    )
