"""What docstrings state: arguments by their names, what is raised, and shapes and units where formulas are."""

import ast
import re

from source import modules, wrong_in
from test_docstrings import public

Function = ast.FunctionDef | ast.AsyncFunctionDef
ARRAY = re.compile(r"\b(Array|ndarray)\b")
SHAPE = re.compile(r"\[[^\]]* x [^\]]*\]|\[\s*\w+\s*\]|\b\d ?x ?\d\b")
DIMENSIONED = {"length", "reference", "point"}
"""Arguments that are lengths or points wherever they occur."""
UNIT = re.compile(r"\b(m|rad|N|SI|dimensionless|units?)\b")


def formulas():
    """The modules where formulas are."""
    return [m for m in modules() if m.split(".")[1:2] in (["algebra"], ["kinematics"], ["kinetostatics"])]


def functions(module):
    return [(name, node, ast.get_docstring(node) or "") for name, node in public(module) if isinstance(node, Function)]


def own(node):
    """The nodes of a function without those of functions within it."""
    pending = list(node.body)
    while pending:
        inner = pending.pop()
        yield inner
        if not isinstance(inner, Function | ast.ClassDef | ast.Lambda):
            pending += ast.iter_child_nodes(inner)


def raises_input_error(node):
    return any(isinstance(one, ast.Raise) and one.exc and "InputError" in ast.unparse(one.exc) for one in own(node))


def arguments(node):
    every = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg)
    return {one.arg for one in every if one} - {"self", "cls"}


def described(docstring):
    """Names in the section `Args:`."""
    section = docstring.partition("Args:\n")[2].split("\n\n")[0]
    names = re.findall(r"^    (\*{0,2}\w[\w*, ]*?):(?: |$)", section, re.MULTILINE)
    return {name.strip(" *") for entry in names for name in entry.split(",")}


def signature(node):
    return f"{ast.unparse(node.args)} -> {ast.unparse(node.returns) if node.returns else ''}"


def test_the_readers_of_docstrings_see_something():
    every = [one for module in modules() for one in functions(module)]
    assert sum(bool(described(docstring)) for _, _, docstring in every) > 100
    assert sum(raises_input_error(node) for _, node, _ in every) > 40
    assert described("Do.\n\nArgs:\n    a, b: numbers.\n        More: of them.\n    *c: names.\n") == {"a", "b", "c"}


def test_every_argument_is_described_where_any_is():
    """Methods without `Args:` may leave all of them to their names."""
    assert not wrong_in(
        lambda m: [name for name, node, doc in functions(m) if described(doc) and described(doc) ^ arguments(node)]
    )


def test_functions_that_refuse_input_say_so():
    assert not wrong_in(
        lambda m: [
            name for name, node, doc in functions(m) if doc and raises_input_error(node) and "InputError" not in doc
        ]
    )


def test_arrays_have_their_shapes():
    assert not wrong_in(
        lambda m: [
            n for n, node, doc in functions(m) if doc and ARRAY.search(signature(node)) and not SHAPE.search(doc)
        ],
        formulas(),
    )


def test_lengths_and_points_have_their_units():
    assert not wrong_in(
        lambda m: [
            n for n, node, doc in functions(m) if doc and arguments(node) & DIMENSIONED and not UNIT.search(doc)
        ],
        formulas(),
    )
