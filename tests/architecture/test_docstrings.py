"""Modules, public classes and public functions say what they are."""

import ast

from source import modules, wrong_in

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


def test_a_module_says_in_its_first_line_what_lives_there():
    def wrong(module):
        tree = modules()[module]
        text = tree.body[0].value.value if tree.body else ""
        line = first_line(tree)
        return len(line) <= 20 or not text.startswith(line)

    assert not [module for module in modules() if wrong(module)]


def test_public_classes_and_functions_are_documented():
    """Methods and properties need no docstring where their name says it all."""
    assert not wrong_in(lambda m: [name for name, node in public(m) if "." not in name and not first_line(node)])


def test_summaries_are_sentences():
    """One summary, ended like a sentence, before any blank line."""
    assert not wrong_in(
        lambda module: [
            name
            for name, node in public(module)
            if (summary := (ast.get_docstring(node) or ".").split("\n\n")[0].rstrip()) and summary[-1] not in ".:;?!"
        ]
    )
