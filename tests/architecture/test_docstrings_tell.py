"""What docstrings tell: arguments by their names, what is raised, and shapes and units where formulas are."""

import ast
import re

import pytest
from source import modules
from test_docstrings import public

Function = ast.FunctionDef | ast.AsyncFunctionDef
FORMULAS = [
    module for module in modules() if module.split(".")[1:2] in (["algebra"], ["kinematics"], ["kinetostatics"])
]
ARRAY = re.compile(r"\b(Array|ndarray)\b")
SHAPE = re.compile(r"\[[^\]]* x [^\]]*\]|\[\s*\w+\s*\]|\b\d ?x ?\d\b")
DIMENSIONED = {"length", "reference", "point"}
"""Arguments that are lengths or points wherever they occur."""
UNIT = re.compile(r"\b(m|rad|N|SI|dimensionless|units?)\b")


def functions(module):
    return [(name, node, ast.get_docstring(node) or "") for name, node in public(module) if isinstance(node, Function)]


def own(node):
    """The nodes of a function without those of functions within it."""
    pending = list(node.body)
    while pending:
        one = pending.pop()
        yield one
        if not isinstance(one, Function | ast.ClassDef | ast.Lambda):
            pending += ast.iter_child_nodes(one)


def raises_input_error(node):
    return any(isinstance(one, ast.Raise) and one.exc and "InputError" in ast.unparse(one.exc) for one in own(node))


def arguments(node):
    every = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg)
    return {one.arg for one in every if one} - {"self", "cls"}


def told(docstring):
    """Names in the section `Args:`."""
    section = docstring.partition("Args:\n")[2].split("\n\n")[0]
    names = re.findall(r"^    (\*{0,2}\w[\w*, ]*?):(?: |$)", section, re.MULTILINE)
    return {name.strip(" *") for entry in names for name in entry.split(",")}


def signature(node):
    return f"{ast.unparse(node.args)} -> {ast.unparse(node.returns) if node.returns else ''}"


def test_the_readers_of_docstrings_see_something():
    every = [one for module in modules() for one in functions(module)]
    assert sum(bool(told(docstring)) for _, _, docstring in every) > 100
    assert sum(raises_input_error(node) for _, node, _ in every) > 40
    assert told("Do.\n\nArgs:\n    a, b: numbers.\n        More: of them.\n    *c: names.\n") == {"a", "b", "c"}


@pytest.mark.parametrize("module", modules())
def test_every_argument_is_told_where_any_is(module):
    wrong = {name: told(doc) ^ arguments(node) for name, node, doc in functions(module) if told(doc)}
    assert not {name: names for name, names in wrong.items() if names}


@pytest.mark.parametrize("module", modules())
def test_who_refuses_input_says_so(module):
    silent = [name for name, node, doc in functions(module) if raises_input_error(node) and "InputError" not in doc]
    assert not silent


@pytest.mark.parametrize("module", FORMULAS)
def test_arrays_have_their_shapes(module):
    without = [n for n, node, doc in functions(module) if ARRAY.search(signature(node)) and not SHAPE.search(doc)]
    assert not without


@pytest.mark.parametrize("module", FORMULAS)
def test_lengths_and_points_have_their_units(module):
    without = [n for n, node, doc in functions(module) if arguments(node) & DIMENSIONED and not UNIT.search(doc)]
    assert not without
