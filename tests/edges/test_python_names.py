"""The names that Python users have: which they are, how they are called, that they are typed, and what they cost.

`python_names.txt` holds them; a name that changes breaks somebody's program, so that changing the file is a decision.
"""

import ast
import importlib
import inspect
import json
import re
import subprocess
import sys
import textwrap
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from report_pages import Page, no_drawing, no_pictures

import kinetostat
from kinetostat import (
    Machine,
    Status,
    analyze,
    build,
    bundled,
    changed,
    compare,
    evaluate_grid,
    export,
    guidelines,
    load,
    load_problem,
    machine_picture,
    optimize,
    plot,
    report,
    save,
    sensitivity,
    validate,
    workspace,
)
from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.machine.parameters import parameters, values
from kinetostat.studies.report import REPORT_PARTS
from refusals import refused

LEAST = [word for part in REPORT_PARTS for word in ("--without", part)]
SNAPSHOT = Path(__file__).with_name("python_names.txt")


def signature(name):
    """A name with its arguments as its source has them, on a line; of a class, its name alone."""
    thing = getattr(kinetostat, name)
    if inspect.isclass(thing):
        return f"class {name}"
    (function,) = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(thing)))).body
    returned = ast.unparse(function.returns).strip("'")  # a class that importing the function does not import
    return f"{name}({ast.unparse(function.args)}) -> {returned}"


def test_the_names_are_those_of_the_file():
    assert SNAPSHOT.read_text().splitlines() == [signature(name) for name in sorted(kinetostat.__all__)]


def test_plot_and_save_cost_as_little_as_analyze_before_they_are_used():
    code = "from kinetostat import plot, save; import sys; print([m for m in %r if m in sys.modules])"
    heavy = ("matplotlib", "xarray", "rich", "numpy", "kinetostat.studies.analysis")
    done = subprocess.run([sys.executable, "-c", code % (heavy,)], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_every_name_has_its_type_for_editors():
    stub = ast.parse(Path(kinetostat.__file__).with_suffix(".pyi").read_text())
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom) and node.module != "typing"]
    typed = {alias.asname: node.module for node in imports for alias in node.names}
    assert set(typed) == set(kinetostat.__all__) == set(dir(kinetostat))
    for name, home in typed.items():
        assert getattr(importlib.import_module(home), name) is getattr(kinetostat, name)


def test_a_name_that_there_is_not_is_refused_with_those_that_there_are():
    with pytest.raises(AttributeError, match=r"has no 'analyse'; it has .*analyze"):
        kinetostat.analyse  # noqa: B018


def test_importing_the_package_imports_nothing():
    code = "import kinetostat, sys; print([m for m in sys.modules if m.startswith('kinetostat.') or m == 'numpy'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_load_analyse_map_optimise_and_plot_in_five_lines(tmp_path):
    machine = load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"])
    assert analyze(machine).status is Status.OK
    grid = evaluate_grid(machine, ["x=-1 cm:1 cm:3", "z=67 cm:69 cm:3"])
    better = optimize(load_problem("zhang-gosselin-2002", ["optimizer.generations=2", "optimizer.population=8"]))
    assert [save(plot(found), tmp_path / f"{n}.png").stat().st_size > 10_000 for n, found in enumerate([grid, better])]


def test_a_machine_is_built_from_text_or_tables_as_from_its_file():
    text = bundled()["tricept"]
    assert build(text).tables == load("tricept").tables
    tables = {
        "schema": 1,
        "name": "mine",
        "family": "planar-3rpr",
        "geometry": {
            "base_radius": 0.4,
            "base_angles": ["-90 deg", "30 deg", "150 deg"],
            "platform_radius": "12 cm",
            "platform_angles": ["-90 deg", "30 deg", "150 deg"],
        },
        "stiffness": {"actuator": "1 N/um"},
        "pose": {"x": 0.0, "y": "1 cm", "angle": "5 deg"},
    }
    before = json.dumps(tables)
    machine = build(tables, settings=["pose.y=2 cm"])
    assert isinstance(machine, Machine)
    assert machine.tables["pose"].y == 0.02
    assert json.dumps(tables) == before
    with refused("base_radius"):
        build({**tables, "geometry": {"base_radius": "wide", "platform_radius": 0.1}})
    with refused("not valid TOML"):
        build("family =")


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "cogiro", "planar-3rpr"])
def test_changed_and_with_values_are_one_function_that_takes_arrays_for_every_vector(name):
    machine = load(name)
    known = values(machine)
    for field in (p for p in parameters(machine.family) if len(p.leaves) > 1 and p.path != "limits"):
        present = [float(known[leaf]) for leaf in field.leaves]
        for kind in (list, tuple, np.array):
            assert machine.with_drafted_values({field.path: kind(present)}) == machine, field.path
    for force in ([0.0, 0.0, 1.0], np.array([0.0, 0.0, 1.0])):
        other = changed(machine, {"load.force": force})
        assert other.tables["load"].force == (0.0, 0.0, 1.0)
        assert other == machine.with_values(load_force=force) == changed(machine, force=force)


def test_changed_and_with_values_refuse_numbers_that_contradict_each_other():
    machine = load("hexapod")
    for change in (machine.with_values, lambda numbers: changed(machine, numbers)):
        with refused("shortest_leg"):
            change({"limits.shortest_leg": 0.9})


def test_a_changed_machine_takes_numbers_and_text_and_leaves_the_first_alone():
    machine = load("hexapod")
    other = changed(machine, {"pose.x": "5 mm", "pose.y": 0.01})
    assert (other.tables["pose"].x, other.tables["pose"].y) == (0.005, 0.01)
    assert machine.tables["pose"].x == 0.0
    with refused('x is "5 kg"'):
        changed(machine, {"pose.x": "5 kg"})


def test_machines_are_compared_under_names_of_their_own():
    machine = load("hexapod")
    pair = [machine, changed(machine, {"pose.z": "16 cm"})]
    assert [design.label for design in compare(pair).designs] == ["design 1", "design 2"]
    named = compare(dict(zip(["low", "high"], pair, strict=True)))
    assert [design.label for design in named.designs] == ["low", "high"]
    assert named.rows == compare(pair).rows
    assert {one.path for one in named.differences} == {"pose.z"}


def answers():
    machine = load("planar-3rpr")
    ranges = ["x=-2 cm:2 cm:5", "y=-2 cm:2 cm:5"]
    return {
        "machine": machine,
        "analysis": analyze(machine),
        "grid": evaluate_grid(machine, ranges),
        "workspace": workspace(machine, ranges),
        "sensitivity": sensitivity(machine),
        "guidelines": guidelines(machine),
        "comparison": compare([machine, changed(machine, {"pose.x": 0.01})]),
        "validation": validate(machine),
    }


@pytest.fixture(scope="module")
def found():
    return answers()


@pytest.mark.parametrize(
    "name", ["machine", "analysis", "workspace", "sensitivity", "guidelines", "comparison", "validation"]
)
def test_an_answer_introduces_itself_in_a_line(found, name):
    """A REPL shows what it is and of what, not ten thousand characters of it."""
    line = repr(found[name])
    assert line.startswith(f"<{type(found[name]).__name__} ")
    assert len(line.splitlines()) == 1
    assert len(line) < 200


@cache
def answer_classes():
    """The classes of ours that public functions return."""
    functions = [getattr(kinetostat, name) for name in kinetostat.__all__]
    drawn = {"Figure": Figure}  # importing `plot` does not import matplotlib
    functions = [inspect.unwrap(function) for function in functions if not inspect.isclass(function)]
    returned = [get_type_hints(function, localns=drawn).get("return") for function in functions]
    return {one for one in returned if is_dataclass(one)}


def test_every_answer_about_a_machine_has_a_line_of_its_own():
    """Not all of its fields, which fill a screen."""
    for one in answer_classes():
        if "machine" in one.__dataclass_fields__:
            assert not hasattr(one.__repr__, "__wrapped__"), one  # as of a dataclass


def test_docstrings_of_public_names_refer_to_nothing_that_is_not_public():
    texts = [path.read_text("utf-8") for path in Path(kinetostat.__file__).parent.rglob("*.py")]
    ours = {name for text in texts for name in re.findall(r"^(?:def|class) (\w+)", text, re.MULTILINE)}
    parts = {name for one in answer_classes() for name in (*one.__dataclass_fields__, *vars(one))}
    public = parts.union(kinetostat.__all__, {"verdict"})  # a variable of a workspace's dataset
    described = [getattr(kinetostat, name) for name in kinetostat.__all__]
    described += [part for one in answer_classes() for part in (one, *vars(one).values()) if part.__doc__]
    for one in described:
        plain = inspect.unwrap(one)
        arguments = set(inspect.signature(plain).parameters) if inspect.isfunction(plain) else set()
        said = re.findall(r"`([\w.]+)`|\b([\w.]+)\(\)", one.__doc__ or "")
        named = {(quoted or called).rpartition(".")[2] for quoted, called in said}
        assert not (named & ours) - public - arguments, one


@pytest.mark.parametrize("name", ["machine", "grid", "workspace", "sensitivity", "guidelines", "comparison"])
def test_answers_have_a_figure(found, name):
    figure = plot(found[name])
    assert figure.axes
    assert figure.get_size_inches().min() > 1.0


def test_a_figure_that_there_is_not_is_refused_with_those_that_there_are(found):
    assert plot(found["guidelines"], "design").axes
    with refused("choose from design"):
        plot(found["guidelines"], "spider web")
    with refused("no figure for a result of type Analysis"):
        plot(found["analysis"])
    with refused("type int is not a result"):
        plot(42)
    with refused("not a result"):
        plot(xr.Dataset())


@pytest.mark.parametrize(
    "name", ["analysis", "grid", "workspace", "sensitivity", "guidelines", "comparison", "validation"]
)
def test_answers_are_kept_as_plain_data(found, name, tmp_path):
    path = save(found[name], tmp_path / "deep" / "answer.json")
    assert isinstance(json.loads(path.read_text("utf-8")), dict)


def test_what_is_kept_is_what_it_was(found, tmp_path):
    assert load(save(found["machine"], tmp_path / "machine.toml")).tables == found["machine"].tables
    assert xr.load_dataset(save(found["grid"], tmp_path / "grid.nc")).identical(found["grid"])
    assert (save(found["machine"], tmp_path / "machine.glb")).read_bytes()[:4] == b"glTF"
    small = machine_picture(found["machine"], (64, 48))
    assert save(small, tmp_path / "small.PNG").read_bytes() == small
    for suffix, start in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        assert save(plot(found["grid"]), tmp_path / f"map{suffix}").read_bytes().startswith(start)


@pytest.mark.parametrize(("name", "file"), [("machine", "machine.step"), ("grid", "grid.csv"), ("analysis", "noend")])
def test_a_suffix_that_cannot_be_written_is_refused_with_those_that_can(found, name, file, tmp_path):
    with refused(r"suffix of .*\.(json|toml)"):
        save(found[name], tmp_path / file)
    assert not list(tmp_path.iterdir())


def test_a_machine_is_exported_as_by_the_command(tmp_path, monkeypatch):
    machine = load("tripteron")
    assert export(machine, tmp_path / "ours.mac") == [tmp_path / "ours.mac"]
    monkeypatch.chdir(tmp_path)
    assert main(["export", "tripteron", "--to", "ansys", "-o", "theirs.mac"]) == DONE
    assert (tmp_path / "ours.mac").read_bytes() == (tmp_path / "theirs.mac").read_bytes()
    assert export(machine, tmp_path / "table.txt", "csv")[0].read_text().startswith("quantity")
    with refused("name it with --to"):
        export(machine, tmp_path / "table.txt")
    with refused("would have to span"):
        export(changed(load("delta"), {"pose.z": "-30 m"}), tmp_path / "far.csv")
    assert not (tmp_path / "far.csv").exists()


@pytest.mark.reports
def test_a_report_of_a_machine_and_of_a_result_say_how_to_have_them_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    no_pictures(monkeypatch)
    no_drawing(monkeypatch)
    machine = load("tripteron", ["pose.x=45 cm"])
    page = Page(report(machine, "our-own.html", without=REPORT_PARTS, author="N. N.").read_text("utf-8"))
    save(machine, "machine.toml")
    assert main(["report", "machine.toml", *LEAST, "--author", "N. N.", "-o", "second.html"]) == DONE
    assert Path("second.html").read_text("utf-8") == Path("our-own.html").read_text("utf-8").replace(
        "our-own.html", "second.html"
    )
    assert page.results["pose"]["x"] == 0.45
    better = optimize(load_problem("zhang-gosselin-2002", ["optimizer.generations=2", "optimizer.population=8"]))
    study = Page(report(better, "study.html", without=REPORT_PARTS).read_text("utf-8"))
    assert study.results["compliance"] == analyze(better.machine).compliance.tolist()


def test_a_report_that_cannot_be_is_refused(tmp_path):
    machine = load("planar-3rpr")
    with refused(r"report is \.html or \.pdf"):
        report(machine, tmp_path / "report.doc")
    with refused('did you mean "maps"'):
        report(machine, tmp_path / "report.html", without=["map"])
    with refused("would have to span"):
        report(changed(load("delta"), {"pose.z": "-30 m"}), tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


def test_the_old_name_of_the_tables_still_works():
    machine = load("tricept")
    with pytest.warns(DeprecationWarning, match=r"Machine\.sections is now called Machine\.tables"):
        assert machine.sections == machine.tables
