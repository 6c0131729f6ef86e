"""Nothing in the package is dead, no function is written twice, and no constant has two values."""

import ast
import re
from collections import Counter, defaultdict

from source import modules, wrong_in

Function = ast.FunctionDef | ast.AsyncFunctionDef
SMALL = 35
"""Nodes of a body up to which functions may be alike: a property that passes a value on, a sum of three products."""
CALLED_FROM_OUTSIDE = {
    "dask_setup": "called by workers of a cluster, by this name",
    "_fill_text": "called by argparse, by this name",
    "_split_lines": "called by argparse, by this name",
    "doctype": "called by the parser of XML, by this name",
    "page_pictures": "the pages of a PDF, for the pictures of the documentation",
    "mass_at_drives": "M over the drives, for programs",
    "gravity_at_drives": "g over the drives, for programs",
    "coriolis_at_drives": "C over the drives, for programs",
    "shares_of": "shares by name, for programs",
    "to_pandas": "tables of pandas, for programs",
    "engines": "what is installed, for tests and benchmarks",
    "_repr_png_": "called by notebooks, by this name",
    "_missing_": "Python, of an enumeration that lacks a value",
}
"""Names that nothing in the package uses, and who does."""


def read_in(tree):
    """Names that a module reads."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def taken_from_others():
    """What is imported, as (module, name); names that are read of objects and modules, or told as text."""
    imported, read = set(), set()
    for tree in modules().values():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                imported |= {(node.module, alias.name) for alias in node.names}
            elif isinstance(node, ast.Attribute):
                read.add(node.attr)
            elif (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and re.fullmatch(r"\w+(\.\w+)*", node.value)
            ):
                read |= set(node.value.split("."))
    return imported, read


def constants_of(tree):
    """Names to which a module itself assigns, as often as it does."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        targets = [each for target in targets for each in getattr(target, "elts", [target])]
        yield from (one.id for one in targets if isinstance(one, ast.Name) and one.id[:2] != "__")


def defined_in(tree):
    """Functions, classes, methods and constants of a module; what Python calls by itself apart."""
    for node in ast.walk(tree):
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("__"):
            yield node.name
    yield from constants_of(tree)


def given_twice(module):
    """Constants to which a module assigns more than once: the last value would hold, also where another is meant."""
    return [name for name, count in Counter(constants_of(modules()[module])).items() if count > 1]


def test_no_constant_has_two_values():
    assert [*constants_of(ast.parse("A = 1\nB, A = 2, 3\nC: int = 4\nfor D in A: pass"))] == ["A", "B", "A", "C", "D"]
    assert not wrong_in(given_twice)


def test_every_name_is_used():
    """By its own module, or by another that imports it from there: a name of the same spelling elsewhere is no use."""
    imported, read = taken_from_others()
    dead = {
        name: module
        for module, tree in modules().items()
        for name in set(defined_in(tree)) - read_in(tree) - read
        if (module, name) not in imported
    }
    assert dead.keys() == CALLED_FROM_OUTSIDE.keys(), dead


class Unnamed(ast.NodeTransformer):
    """Calls what is local to a function by numbers."""

    def __init__(self, function):
        stored = {n.id for n in ast.walk(function) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}
        given = [one.arg for one in ast.walk(function.args) if isinstance(one, ast.arg)]
        self.names = {name: f"_{i}" for i, name in enumerate((*given, *sorted(stored - set(given))))}

    def visit_Name(self, node):
        return ast.Name(self.names.get(node.id, node.id), node.ctx)


def content(function):
    """The statements of a function without its docstring."""
    return function.body[1:] if ast.get_docstring(function) else function.body


def kinds(function):
    """The kinds of all nodes of the content, in order: functions that are alike have the same."""
    return tuple(type(node) for statement in content(function) for node in ast.walk(statement))


def normal(function):
    """The content of a function without the names of what is local to it."""
    # Parsed again rather than copied: libraries hang trees of their own on the singletons that all syntax trees share.
    return Unnamed(function).visit(ast.parse("\n".join(map(ast.unparse, content(function)))))


def test_names_of_what_is_local_do_not_matter():
    one, same, other = ast.parse(
        "def f(a): b = g(a); return b\ndef f(x): y = g(x); return y\ndef f(x): return h(x)"
    ).body
    assert ast.dump(normal(one)) == ast.dump(normal(same)) != ast.dump(normal(other))


def test_no_function_is_written_twice():
    """Only functions with the same kinds of nodes are written out and compared, because that takes long."""
    alike, found = defaultdict(list), defaultdict(list)
    for module, tree in modules().items():
        for node in ast.walk(tree):
            if isinstance(node, Function) and len(nodes := kinds(node)) > SMALL:
                alike[nodes].append((f"{module}.{node.name}", node))
    for name, node in (each for group in alike.values() if len(group) > 1 for each in group):
        found[ast.dump(normal(node))].append(name)
    assert not [places for places in found.values() if len(places) > 1]
