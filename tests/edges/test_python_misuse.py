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
    budget,
    build,
    bundled,
    carrying_legs,
    changed,
    command,
    compare,
    correction_table,
    evaluate,
    evaluate_grid,
    export,
    forward,
    guidelines,
    identify,
    load,
    load_problem,
    machine_picture,
    modes,
    optimize,
    plot,
    register,
    report,
    reproduce,
    requirements,
    save,
    sensitivity,
    under_load,
    validate,
    validate_measured,
    workspace,
)
from kinetostat.spec.arguments import words_of
from refusals import refused

H = load("hexapod")
A = analyze(H)
HEAVY = load("hexapod", ['tool.mass="12 kg"', "tool.inertia=[0.3, 0.3, 0.5, 0, 0, 0]"])
JOINTS = {"joints": "0.05 mm"}
MEASURED = "f.csv"
TABLE = "x [mm],y [mm],z [mm],measured.x [mm],measured.y [mm],measured.z [mm]\n" + "".join(
    f"{x},{y},{130 + x},{x + 0.01},{y},{130 + x}\n" for x in (-4, 0, 5) for y in (-3, 2)
)
OVER = ["x=-1 cm:1 cm:3", "y=-1 cm:1 cm:3"]
SIZE = (64, 64)
HEAD = {"schema": 1, "name": "a", "family": "hexapod"}


@cache
def problem():
    return load_problem("zhang-gosselin-2002", ["optimizer.population=8", "optimizer.generations=2"])


@cache
def ringing():
    return modes(HEAVY)


@cache
def off():
    return budget(H, tolerances=JOINTS, samples=64)


class Odd:
    """Nothing that anybody expects."""


class Mute:
    """What cannot show itself."""

    def __repr__(self):
        raise RuntimeError


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
    ("values", lambda: changed(H, [1])),
    ("key of values", lambda: changed(H, {3: 1})),
    (r"values\['x'\]", lambda: changed(H, {"x": None})),
    (r"values\['x'\]", lambda: changed(H, {"x": Odd()})),
    (r"values\['x'\]", lambda: changed(H, {"x": b"1"})),
    (r"values\['x'\]", lambda: changed(H, {"x": 1j})),
    (r"values\['base_angles'\]", lambda: changed(H, {"base_angles": {1, 2, 3, 4, 5, 6}})),
    (r"geometry\.base_angles\.0", lambda: changed(H, {"base_angles": np.zeros((6, 1))})),
    ("x", lambda: changed(H, x=Odd())),
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
    ("machine", lambda: modes("hexapod")),
    ("machine", lambda: modes(A)),
    ("machine", lambda: modes()),
    ("loaded", lambda: modes(HEAVY, loaded=True)),
    ("machine", lambda: budget("hexapod")),
    ("poses", lambda: budget(H, 3)),
    ("poses", lambda: budget(H, {"x": [Odd()]})),
    ("poses", lambda: budget(H, "absent.csv")),
    ("ranges", lambda: budget(H, ranges=3)),
    ("count", lambda: budget(H, None, "x=0:1:3 m")),
    ("tolerances", lambda: budget(H, tolerances=["joints"])),
    ("tolerances", lambda: budget(H, tolerances="joints=1 mm")),
    ("joints", lambda: budget(H, tolerances={"joints": Odd()})),
    ("joints", lambda: budget(H, tolerances={"joints": None})),
    ("joints", lambda: budget(H, tolerances={"joints": float("nan")})),
    ("key of tolerances", lambda: budget(H, tolerances={3: "1 mm"})),
    ("along", lambda: budget(H, along="z", tolerances=JOINTS)),
    ("along", lambda: budget(H, along=(0, 0, 0), tolerances=JOINTS)),
    ("along", lambda: budget(H, along=(1,), tolerances=JOINTS)),
    ("along", lambda: budget(H, along=(np.inf, 0, 0), tolerances=JOINTS)),
    ("samples", lambda: budget(H, samples=-1, tolerances=JOINTS)),
    ("samples", lambda: budget(H, samples=1e3, tolerances=JOINTS)),
    ("samples", lambda: budget(H, samples=10**12, tolerances=JOINTS)),
    ("exact", lambda: budget(H, exact=10**12, tolerances=JOINTS)),
    ("exact", lambda: budget(H, exact="many", tolerances=JOINTS)),
    ("allocate", lambda: budget(H, allocate="5 kg", tolerances=JOINTS)),
    ("allocate", lambda: budget(H, allocate=-1.0, tolerances=JOINTS)),
    ("allocate", lambda: budget(H, allocate=[1], tolerances=JOINTS)),
    ("allocate", lambda: budget(H, allocate=float("nan"), tolerances=JOINTS)),
    ("by", lambda: budget(H, by="mean", tolerances=JOINTS)),
    ("seed", lambda: budget(H, seed=-1, tolerances=JOINTS)),
    ("progress", lambda: budget(H, progress=3)),
    ("statistic", lambda: off().size("mad", "x")),
    ("measure", lambda: off().size("rms", "q")),
    ("key", lambda: off().shares_by("colour")),
    ("measure", lambda: off().shares_by("line", "q")),
    ("statistic", lambda: off().size(None, "x")),
    ("statistic", lambda: off().size("__class__", "x")),
    ("data", lambda: identify(H)),
    ("data", lambda: identify(H, None)),
    ("data", lambda: identify(H, 3)),
    ("data", lambda: identify(H, {"x": [1]})),
    ("f.csv", lambda: identify(H, "f.csv")),
    ("CSV", lambda: identify(H, ".")),
    ("machine", lambda: identify("hexapod", MEASURED)),
    ("fit", lambda: identify(H, MEASURED, None)),
    ("fit", lambda: identify(H, MEASURED, [3])),
    ("zero", lambda: identify(H, MEASURED, "zero")),
    ("fit", lambda: identify(H, MEASURED, [])),
    ("frame", lambda: identify(H, MEASURED, ["zeros"], frame="yes")),
    ("target", lambda: identify(H, MEASURED, ["zeros"], target=3)),
    ("sigma", lambda: identify(H, MEASURED, ["zeros"], sigma=5e-6)),
    ("sigma", lambda: identify(H, MEASURED, ["zeros"], sigma="5 kg")),
    ("sigma_angle", lambda: identify(H, MEASURED, ["zeros"], sigma_angle=None)),
    ("priors", lambda: identify(H, MEASURED, ["zeros"], priors=["zeros=1 mm"])),
    (r"priors\['zeros'\]", lambda: identify(H, MEASURED, ["zeros"], priors={"zeros": 1e-3})),
    ("bounds", lambda: identify(H, MEASURED, ["zeros"], bounds="zeros=1")),
    ("bounds", lambda: identify(H, MEASURED, ["zeros"], bounds={3: "1 mm"})),
    ("robust", lambda: identify(H, MEASURED, ["zeros"], robust="no")),
    ("more", lambda: identify(H, MEASURED, ["zeros"], more=-1)),
    ("more", lambda: identify(H, MEASURED, ["zeros"], more=1.5)),
    ("more", lambda: identify(H, MEASURED, ["zeros"], more=10**9)),
    ("tell", lambda: identify(H, MEASURED, ["zeros"], tell=3)),
    ("too many", lambda: identify(H, MEASURED, ["zeros"], True)),
    ("direction", lambda: ringing().along(None, [1.0])),
    ("direction", lambda: ringing().along((0, 0, 0), [1.0])),
    ("direction", lambda: ringing().softest("z")),
    ("frequencies", lambda: ringing().receptance(None)),
    ("frequencies", lambda: ringing().receptance(["a"])),
    ("frequencies", lambda: ringing().along((0, 0, 1), 5.0)),
    ("fit", lambda: identify(H, MEASURED, [])),
    ("machine", lambda: under_load("hexapod")),
    ("machine", lambda: command("hexapod")),
    ("poses", lambda: command(H, 3)),
    ("machine", lambda: carrying_legs(None, OVER)),
    ("ranges", lambda: carrying_legs(H, None)),
    ("ranges", lambda: carrying_legs(H, [3])),
    ("over", lambda: correction_table(H, None)),
    ("over", lambda: correction_table(H, [3])),
    ("over", lambda: correction_table(H, {"x": 1})),
    ("tolerance", lambda: correction_table(H, "x=-1 cm:1 cm:3", tolerance=[1])),
    ("tolerance", lambda: correction_table(H, "x=-1 cm:1 cm:3", tolerance="1 kg")),
    ("tolerance", lambda: correction_table(H, "x=-1 cm:1 cm:3", tolerance=-1.0)),
    ("data", lambda: validate_measured(H, None)),
    ("machine", lambda: validate_measured("hexapod", MEASURED)),
    ("fit", lambda: validate_measured(H, MEASURED, fit=3)),
    ("sigma", lambda: validate_measured(H, MEASURED, sigma=3)),
    ("sigma", lambda: validate_measured(H, MEASURED, sigma="3 kg")),
    ("inputs", lambda: export(HEAVY, "a.mat", inputs=3)),
    ("inputs", lambda: export(HEAVY, "a.mat", inputs=["nose"])),
    ("outputs", lambda: export(HEAVY, "a.mat", outputs=[3])),
    ("outputs", lambda: export(HEAVY, "a.mat", outputs=[])),
    ("inputs", lambda: export(HEAVY, "a.xml", inputs=["force.x"])),
    ("inputs", lambda: export(HEAVY, "a.mat", inputs=[])),
    ("which", lambda: plot(ringing(), "nose")),
    ("which", lambda: plot(ringing(), 3)),
    ("which", lambda: plot(off(), "nose")),
    ("suffix", lambda: save(ringing(), "a.png")),
    ("suffix", lambda: save(off(), "a.toml")),
    ("path", lambda: save(off(), 3)),
    ("poses", lambda: budget(H, 10**400, tolerances=JOINTS)),
    ("null character", lambda: budget(H, "\0.csv", tolerances=JOINTS)),
    ("null character", lambda: identify(H, "\0.csv")),
    ("name too long", lambda: report(H, "a.html", fit="a" * 5000)),
    ("name is too long", lambda: export(HEAVY, "a" * 5000, "modes")),
    ("ranges", lambda: budget(H, ranges=np.array(1.0))),
    ("quantities", lambda: evaluate(H, {"x": [0]}, np.array("x"))),
    ("allocate", lambda: budget(H, allocate=1e308, tolerances=JOINTS)),
    ("allocate", lambda: budget(H, allocate=5e-324, tolerances=JOINTS)),
    ("over", lambda: correction_table(H, [])),
    ("over", lambda: correction_table(H, np.array([]))),
    (r"frequencies\[1\]", lambda: ringing().receptance([1.0, np.nan])),
    (r"frequencies\[0\]", lambda: ringing().along((0, 0, 1), [1e300])),
    ("Mute", lambda: modes(Mute())),
]


@pytest.mark.parametrize(("name", "misuse"), MISUSES, ids=[str(number) for number in range(len(MISUSES))])
def test_a_misuse_is_refused_by_the_name_of_the_argument(name, misuse, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.csv").write_text(TABLE)
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
    whole = budget(H, tolerances=JOINTS, along=(100, 100, 100), samples=64, ranges=[])
    small = np.array([100, 100, 100], dtype=np.int8)  # whose squares do not fit into their kind
    assert budget(H, tolerances=JOINTS, along=small, samples=np.uint8(64), ranges=np.array([])) == whole
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
