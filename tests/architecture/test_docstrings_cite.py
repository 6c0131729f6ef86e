"""Where formulas are, docstrings say in which frame they hold and where they come from, and what they cite exists."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest
from source import modules, wrong_in
from test_docstrings import public
from test_docstrings_tell import formulas, functions, signature

THEORY = (Path(__file__).parents[2] / "docs" / "theory.md").read_text("utf-8")
EQUATIONS = {int(number) for number in re.findall(r"\\tag\{(\d+)\}", THEORY)}
SECTIONS = {int(number) for number in re.findall(r"^## (\d+)\. ", THEORY, re.MULTILINE)}
PRINTED = set(range(1, 42))
"""Equations of the paper."""

PLACED = re.compile(r"\b(Vector|Displacement|Twist|Wrench|AnyScrew|Screw|Symmetric6)\b")
FRAME = re.compile(r"\b(frame|axes|reference point)\b")
ROOMS = {"algebra", "machine", "kinematics", "kinetostatics"}
"""Where points, screws and matrices are computed."""
VOCABULARY = {"kinetostat.algebra.scalar", "kinetostat.kinematics.status"}
"""Names for what others compute: they have no source."""

EQUATION = re.compile(r"theory (\(\d+\)(?:(?:, | and |-)\(\d+\))*)")
SECTION = re.compile(r"theory sections? (\d+(?:(?:, | and | to )\d+)*)")
PAPER = re.compile(r"\beqs?\. (\d+(?:(?:, | and |-)\d+)*)")


def cited(texts, sign):
    """The numbers after a sign: (4)-(6) and (8) are 4, 5, 6 and 8."""
    found = set()
    for text in texts:
        for items in sign.findall(" ".join(text.split())):
            plain = items.replace("(", "").replace(")", "").replace(" to ", "-")
            for item in re.split(", | and ", plain):
                first, _, last = item.partition("-")
                found |= set(range(int(first), int(last or first) + 1))
    return found


def docstrings(module):
    tree = modules()[module]
    return [ast.get_docstring(tree) or "", *(ast.get_docstring(node) or "" for _, node in public(module))]


@cache
def every_docstring():
    return [text for module in modules() for text in docstrings(module)]


def test_the_reader_of_citations_sees_them():
    text = "Source: theory (4)-(6) and (8), eqs. 21 and 33-38; theory sections 2 to 4 and 7."
    assert cited([text], EQUATION) == {4, 5, 6, 8}
    assert cited([text], SECTION) == {2, 3, 4, 7}
    assert cited([text], PAPER) == {21, *range(33, 39)}


def test_what_is_cited_is_there():
    assert cited(every_docstring(), EQUATION) <= EQUATIONS
    assert cited(every_docstring(), SECTION) <= SECTIONS
    assert cited(every_docstring(), PAPER) <= PRINTED


def test_equations_are_numbered_in_their_order():
    numbers = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", THEORY)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_every_equation_of_the_theory_is_where_it_is_computed():
    assert EQUATIONS - cited(every_docstring(), EQUATION) == set()
    assert sorted(EQUATIONS) == list(range(1, len(EQUATIONS) + 1))


def test_formulas_have_a_source():
    def unsourced(module):
        return list(public(module)) and not any(
            re.search(r"\bSources?: |\btheory ", text) for text in docstrings(module)
        )

    assert not [module for module in sorted(set(formulas()) - VOCABULARY) if unsourced(module)]


def test_points_and_screws_have_a_frame():
    def unplaced(module):
        if FRAME.search(docstrings(module)[0]):
            return []
        placed = [(name, doc) for name, node, doc in functions(module) if PLACED.search(signature(node))]
        return [name for name, doc in placed if not FRAME.search(doc)]

    assert not wrong_in(unplaced, [module for module in modules() if set(module.split(".")[1:2]) & ROOMS])


def test_the_site_can_typeset_every_formula_of_the_theory():
    convert = pytest.importorskip("latex2mathml.converter").convert
    formulas = re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", THEORY, re.DOTALL)
    assert len(formulas) > 300
    for display, inline in formulas:
        assert convert(display or inline)
