"""The shape of the house, read from its imports: one direction, no cycle, JAX in one place, files that stay small."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter

import pytest
from source import PACKAGE, ROOT, imports, modules

LAYERS = [
    "tolerances",
    "units",
    "spec",
    "algebra",
    "machine",
    "kinematics",
    "kinetostatics",
    "engine",
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
    assert "pydantic" in imports("kinetostat.spec.fields")


def test_every_module_has_its_layer():
    unknown = {layer(module) for module in modules()} - {"", *LAYERS, *EDGES}
    assert not unknown, "give new packages a place in LAYERS"


@pytest.mark.parametrize("module", modules())
def test_imports_point_downwards(module):
    if layer(module) == "":
        assert not ours(module), "the package itself stays empty, so that any part of it can be imported alone"
    above = {name for name in ours(module) if rank(name) > rank(module)}
    assert not above
    if layer(module) not in EDGES:
        assert not {name for name in ours(module) if layer(name) in EDGES}


def test_there_is_no_import_cycle():
    graph = {module: ours(module) & set(modules()) - {module} for module in modules()}
    assert set(TopologicalSorter(graph).static_order()) >= set(modules())


@pytest.mark.parametrize("module", [m for m in modules() if layer(m) == "algebra"])
def test_algebra_needs_only_the_standard_library(module):
    outside = {name for name in imports(module) if name.split(".")[0] not in sys.stdlib_module_names}
    assert all(name == "kinetostat.algebra" or name.startswith("kinetostat.algebra.") for name in outside)


@pytest.mark.parametrize("module", [m for m in modules() if layer(m) != "engine"])
def test_only_the_engine_knows_jax(module):
    assert not {name for name in imports(module) if name.split(".")[0] in ("jax", "jaxlib")}


LIGHT = ["kinetostat.spec.validation", "kinetostat.machine.loading", "kinetostat.studies.analysis"]


def test_an_analysis_starts_without_jax():
    """One pose needs no compiler: what loads a machine and analyses it must not load JAX through others either."""
    code = (
        f"import {', '.join(LIGHT)}, sys; print([m for m in sys.modules if m.split('.')[0] in ('jax', 'matplotlib')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


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


@pytest.mark.parametrize("path", sorted(ROOT.rglob("*.py")), ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_too_long(path):
    assert len(path.read_text("utf-8").splitlines()) <= LONGEST


@pytest.mark.parametrize("module", modules())
def test_asserts_are_not_for_users(module):
    """`assert` disappears under `python -O`; errors of users are exceptions with a message."""
    assert not [node.lineno for node in ast.walk(modules()[module]) if isinstance(node, ast.Assert)]
