"""The words of CONTRIBUTING.md hold in names, docstrings, messages and pages."""

import ast
import re
from collections import Counter

from source import ROOT, modules

from pages import pages

NAMES = {"found", "one", "held", "told", "own", "said", "asked"}
"""Names that do not say what they hold."""
WORDS = {
    r"yield(s|ed|ing)?": "deflects, flexible, compliant",
    r"regularity": "singularity margin",
    r"blame": "attribution, contribution",
    r"whoever|whatever is|what is but": "name the subject",
    r"anew": "again",
    r"rival": "second answer",
    r"(not|of) ours": "independent, of kinetostat",
    r"(?<!there )is no (?!longer\b|more\b|less\b|better\b|worse\b|other\b)\w+": "is not a ..., there is no ...",
    r"the like": "name them",
}
"""Words that these texts do not use, and what to write instead."""
FORMER = ("kinetostat.spec.renamed",)
"""Modules that must name former words."""
TABLES_OF_WORDS = ("CONTRIBUTING.md", "docs/glossary.md", "docs/changelog.md")


def names(tree):
    """Every name that a module gives: of arguments, variables, functions, classes and attributes."""
    for node in ast.walk(tree):
        match node:
            case ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield name


def texts(tree):
    """Docstrings, messages and other texts of a module."""
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def misused(text):
    """Words of a text that these pages do not use, with what to write instead."""
    return {
        match.group(): instead
        for pattern, instead in WORDS.items()
        for match in re.finditer(rf"(?<![\w-])({pattern})(?![\w-])", text, re.IGNORECASE)
    }


def test_the_readers_see_names_and_words():
    tree = ast.parse('def told(one):\n    found = "kg is no unit, whoever yields"')
    assert Counter(names(tree)) == Counter(["told", "one", "found"])
    assert {*misused(texts(tree)[0])} == {"is no unit", "whoever", "yields"}
    assert not misused("It is no longer than before; fields of files")


def test_names_say_what_they_hold():
    misnamed = {module: NAMES & set(names(tree)) for module, tree in modules().items()}
    assert not {module: words for module, words in misnamed.items() if words}


def test_texts_use_the_words_of_the_glossary():
    wrong = {module: misused("\n".join(texts(tree))) for module, tree in modules().items() if module not in FORMER}
    assert not {module: words for module, words in wrong.items() if words}


def test_pages_use_the_words_of_the_glossary():
    wrong = {str(page): misused(page.read_text("utf-8")) for page in pages() if not str(page).endswith(TABLES_OF_WORDS)}
    assert not {page: words for page, words in wrong.items() if words}
    bundled = {path.name: misused(path.read_text("utf-8")) for path in ROOT.rglob("*.toml")}
    assert not {name: words for name, words in bundled.items() if words}
