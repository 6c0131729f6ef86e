"""Every public module, class, function and method says what it is."""

import ast

import pytest
from source import modules

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def public(module):
    """Public classes, functions and methods of a module, by their dotted name; what is inside a function is private."""
    pending = [(node.name, node) for node in modules()[module].body if isinstance(node, Definition)]
    while pending:
        name, node = pending.pop()
        if node.name.startswith("_"):
            continue
        yield name, node
        if isinstance(node, ast.ClassDef):
            pending += [(f"{name}.{inner.name}", inner) for inner in node.body if isinstance(inner, Definition)]


def first_line(node):
    return (ast.get_docstring(node) or "").partition("\n")[0].strip()


def test_the_search_finds_methods():
    assert {"Vector", "Vector.dot", "polar"} <= {name for name, _ in public("kinetostat.algebra.vector")}


@pytest.mark.parametrize("module", modules())
def test_a_module_says_in_its_first_line_what_lives_there(module):
    text = modules()[module].body[0].value.value if modules()[module].body else ""
    line = first_line(modules()[module])
    assert line
    assert text.startswith(line), "the docstring starts on its first line"
    assert len(line) > 20


@pytest.mark.parametrize("module", modules())
def test_public_classes_and_functions_are_documented(module):
    """Methods and properties need no docstring where their name says it all."""
    missing = [name for name, node in public(module) if "." not in name and not first_line(node)]
    assert not missing


@pytest.mark.parametrize("module", modules())
def test_summaries_are_sentences(module):
    """One summary line, ended like a sentence, before any blank line."""
    wrong = [
        name
        for name, node in public(module)
        if (summary := (ast.get_docstring(node) or ".").split("\n\n")[0].rstrip()) and summary[-1] not in ".:;?!"
    ]
    assert not wrong
