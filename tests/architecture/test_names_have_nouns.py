"""Names and first lines: functions have nouns, class names one meaning, first lines say the thing, files are no slips.

Where a rule is not kept everywhere, a limit for each room says how many places are left. Limits only fall.
"""

import ast
import re
from collections import Counter, defaultdict

from source import ROOT, imports, module_name, modules

ENDING = r"[a-z]+(ed|en|wn|lt|nt)"
ADVERB = r"held|told|found|said|kept|made|left|together|apart|away|there|here"
PARTICIPLE = re.compile(rf"_?({ENDING}|{ADVERB})")
"""Names of functions that are a lone participle or adverb, by their endings."""
NOUNS = """
    agent alignment amount argument attachment bolt children client complement component constraint content
    count default different displacement document element extent fault font front gradient hidden hint indent
    instant joint listen moment mount open percent placement point present print result salt screen segment
    shorten silent specimen statement tangent then tilt unseen variant when
"""
"""Nouns, verbs and conjunctions with such an ending."""
FLAGS = {"bool", "Mask"}
"""Types of a flag, and of an array of flags."""
ASKING = re.compile(r"(What|Which|How|Where|When)\b")
"""Beginnings of first lines that describe a thing by a question."""
SHORTEST = 60
"""Lines of a file that is read with only one other; a shorter one belongs there."""
CATALOGUE = "kinetostat.machine.catalogue"
"""Families: each has the same classes for its tables, and is imported by a list."""
PARTICIPLES_LEFT: dict[str, int] = {
    "algebra": 4,
    "kinematics": 1,
    "machine": 14,
    "spec": 1,
    "studies": 1,
}
CLASSES_LEFT: frozenset[str] = frozenset(
    {
        "Axis",
        "Body",
        "Element",
        "Field",
        "Modes",
        "Pace",
        "Picture",
        "Report",
        "Softest",
        "Step",
        "_Chain",
        "_Reader",
    }
)
SLIPS_LEFT: frozenset[str] = frozenset()
"""Places that are left, by room or by name."""


def room(module):
    return module.split(".")[1] if "." in module else ""


def participles(tree):
    """Functions that are named by a lone participle and do not return a flag."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    named = [f for f in functions if PARTICIPLE.fullmatch(f.name) and f.name.lstrip("_") not in NOUNS.split()]
    return [f.name for f in named if not (isinstance(f.returns, ast.Name) and f.returns.id in FLAGS)]


def first_lines(tree):
    """First lines of all docstrings, those below constants and fields too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value.value.strip().split("\n")[0]


def left_in_rooms(places_of):
    """Number of places by room in which a rule is not kept."""
    counts = Counter({room(module): 0 for module in modules()})
    for module, tree in modules().items():
        counts[room(module)] += len(places_of(tree))
    return {name: count for name, count in counts.items() if count}


def beyond(counts, limits):
    return {name: count for name, count in counts.items() if count > limits.get(name, 0)}


def test_the_readers_see_names_and_lines():
    tree = ast.parse('"""What it is."""\ndef moved(): pass\ndef held() -> bool: pass\nX = 1\n"""How many."""')
    assert participles(tree) == ["moved"]
    assert [line for line in first_lines(tree) if ASKING.match(line)] == ["What it is.", "How many."]


def test_a_function_that_is_no_flag_is_named_by_a_noun_or_a_verb():
    assert not beyond(left_in_rooms(participles), PARTICIPLES_LEFT)


def test_first_lines_say_the_thing():
    asking = {module: [line for line in first_lines(tree) if ASKING.match(line)] for module, tree in modules().items()}
    assert not {module: lines for module, lines in asking.items() if lines}


def test_a_class_name_has_one_meaning():
    homes = defaultdict(list)
    for module, tree in modules().items():
        if not module.startswith(CATALOGUE):
            for node in tree.body:
                if isinstance(node, ast.ClassDef):
                    homes[node.name].append(module)
    assert not {name: found for name, found in homes.items() if len(found) > 1 and name not in CLASSES_LEFT}


def test_a_file_that_is_read_with_one_other_is_not_short():
    readers, registered = defaultdict(set), set()
    for module, tree in modules().items():
        for name in imports(module):
            readers[name].add(module)
        for node in ast.walk(
            tree
        ):  # a registry names modules in texts, such as "exchange.mjcf.write": a file for each row
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                words = node.value.split(":")[0]
                registered |= {f"kinetostat.{name}" for name in (words, words.rpartition(".")[0])}
    short = {
        module_name(path): len(path.read_text("utf-8").splitlines())
        for path in ROOT.rglob("*.py")
        if not path.stem.startswith("__") and not module_name(path).startswith(CATALOGUE)
    }
    slips = {m for m, count in short.items() if count < SHORTEST and len(readers[m] - {m}) <= 1}
    assert not slips - registered - SLIPS_LEFT
