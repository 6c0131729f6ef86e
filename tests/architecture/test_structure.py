"""The shape of the house, read from its imports: one direction, no cycle, JAX in one place, files that stay small."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

from source import PACKAGE, ROOT, imports, modules, wrong_in

LAYERS = [
    "frozen",
    "late",
    "arrays",
    "tolerances",
    "units",
    "display",
    "spec",
    "algebra",
    "machine",
    "numerics",
    "kinematics",
    "kinetostatics",
    "equilibrium",
    "vibration",
    "motion",
    "engine",
    "accuracy",
    "studies",
    "validation",
    "views",
    "exchange",
]
"""From the bottom up (DESIGN section 4): each may import itself and those before it."""
EDGES = ["commands", "cli", "studio", "__main__"]
"""Thin edges above all layers; nobody below imports them."""
LONGEST = 450
"""Lines of a file."""
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def ours(module: str) -> set[str]:
    return {name for name in imports(module) if name.split(".")[0] == PACKAGE}


def layer(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def rank(module: str) -> int:
    return LAYERS.index(layer(module)) if layer(module) in LAYERS else len(LAYERS)


def test_the_parser_sees_imports():
    """Guards the tests below against passing on an empty list."""
    assert len(modules()) > 20
    assert "kinetostat.algebra.scalar" in ours("kinetostat.algebra.solve")
    assert "kinetostat.spec.document" in ours("kinetostat.machine.loading")
    assert "pydantic" in imports("kinetostat.spec.study")


def test_every_module_has_its_layer():
    unknown = {layer(module) for module in modules()} - {"", *LAYERS, *EDGES}
    assert not unknown, "give new packages a place in LAYERS"


def test_imports_point_downwards():
    """The package itself imports nothing, so that any part of it can be imported alone; nobody imports an edge."""

    def upwards(module):
        if layer(module) == "":
            return ours(module)
        above = {name for name in ours(module) if rank(name) > rank(module)}
        return above | {name for name in ours(module) if layer(name) in EDGES and layer(module) not in EDGES}

    assert not wrong_in(upwards)


def test_there_is_no_import_cycle():
    graph = {module: ours(module) & set(modules()) - {module} for module in modules()}
    assert set(TopologicalSorter(graph).static_order()) >= set(modules())


def test_algebra_needs_only_the_standard_library_and_tolerances():
    """Its scalars bring their own functions; `frozen` is the standard library's decorator, compiled later."""
    allowed = {"kinetostat.tolerances", "kinetostat.frozen"}

    def outside(module):
        others = {name for name in imports(module) if not f"{name}.".startswith("kinetostat.algebra.")} - allowed
        return {name for name in others if name.split(".")[0] not in sys.stdlib_module_names}

    assert not wrong_in(outside, [m for m in modules() if layer(m) == "algebra"])


def test_nothing_knows_jax():
    assert not wrong_in(lambda m: {name for name in imports(m) if name.split(".")[0] in ("jax", "jaxlib")})


LIGHT = ["kinetostat.spec.validation", "kinetostat.machine.loading", "kinetostat.studies.analysis"]


HEAVY = ("jax", "matplotlib", "pydantic", "scipy", "xarray")


def test_an_analysis_starts_without_heavy_libraries():
    """What loads a machine and analyses it must not load them through others either: importing them takes longer."""
    code = f"import {', '.join(LIGHT)}, sys; print([m for m in sys.modules if m.split('.')[0] in {HEAVY}])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


UNCALLED = [
    "engine",
    "vibration",
    "accuracy",
    "validation",
    "exchange",
    "studio",
    "equilibrium.solving",
    "machine.written.family",
]
"""Rooms and files that the analysis of a free machine of a family never calls."""


def test_an_analysis_imports_what_it_calls():
    """Each module costs as much as a hundredth of an analysis: see `late`."""
    code = (
        "import sys; from kinetostat.cli import main; main(['analyze', 'hexapod']); "
        "print('imported:', *(m.removeprefix('kinetostat.') for m in sys.modules if m.startswith('kinetostat.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    imported = done.stdout.rpartition("imported:")[2].split()
    assert "equilibrium.state" in imported
    assert not [name for name in imported for part in UNCALLED if f"{name}.".startswith(f"{part}.")]


def test_frozen_classes_are_compiled_late():
    """The standard decorator compiles six methods of a class when its module is imported; most runs never call them."""

    def by_the_standard_library(module):
        names = {
            f"{node.module}.{alias.name}"
            for node in ast.walk(modules()[module])
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        options = {
            word.arg for node in ast.walk(modules()[module]) if isinstance(node, ast.Call) for word in node.keywords
        }
        return {"dataclasses.dataclass"} & names if "frozen" in options else set()

    assert not wrong_in(by_the_standard_library, set(modules()) - {"kinetostat.frozen"})


def lacking(tree: ast.Module) -> list[str]:
    """What a program outside the package imports from it that is not there."""
    froms = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and (n.module or "").split(".")[0] == PACKAGE]
    taken = [(node.module, alias.name) for node in froms for alias in node.names]
    return [f"{m}.{n}" for m, n in taken if f"{m}.{n}" not in modules() and not hasattr(import_module(m), n)]


def test_benchmarks_import_what_is_there():
    """No test runs them, so that a new name would break them unseen."""
    assert lacking(ast.parse("from kinetostat import load, loads\nfrom kinetostat.engine import moving")) == [
        "kinetostat.loads"
    ]
    benchmarks = {path.name: ast.parse(path.read_text("utf-8")) for path in sorted(BENCHMARKS.glob("*.py"))}
    assert benchmarks
    assert not {name: lacking(tree) for name, tree in benchmarks.items() if lacking(tree)}


def test_no_star_import():
    stars = [
        m
        for m, tree in modules().items()
        for n in ast.walk(tree)
        if isinstance(n, ast.ImportFrom)
        for a in n.names
        if a.name == "*"
    ]
    assert not stars


def test_no_file_is_too_long():
    lengths = {str(path.relative_to(ROOT)): len(path.read_text("utf-8").splitlines()) for path in ROOT.rglob("*.py")}
    assert not {path: length for path, length in lengths.items() if length > LONGEST}


def test_asserts_are_not_for_users():
    """`assert` disappears under `python -O`; errors of users are exceptions with a message."""
    assert not wrong_in(lambda m: [node.lineno for node in ast.walk(modules()[m]) if isinstance(node, ast.Assert)])
