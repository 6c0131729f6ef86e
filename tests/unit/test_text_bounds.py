"""The scan before the parser sees strings and comments where the parser sees them, and takes linear time."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetostat.spec.document import DEEPEST, check_bounds
from refusals import refused

PIECES = ['"', '"""', "'", "'''", "\\", "#", "\n", ".", "=", ",", "[", "]", "{", "}", "a", " ", '"b"', "1.5", "x = "]


def depth(value):
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return 0 if inner is None else 1 + max(map(depth, inner), default=0)


@given(st.lists(st.sampled_from(PIECES), max_size=60).map("".join))
def test_what_passes_is_never_deeper_than_a_header_and_its_keys_allow(text):
    try:
        check_bounds(text, "x")
        document = tomllib.loads(text)
    except ValueError:
        return
    assert depth(document) <= 4 * DEEPEST


@pytest.mark.parametrize(
    "text",
    [
        'a = "a.a.a.a.a.a.a.a.a.a.a"',
        "# a.a.a.a.a.a.a.a.a.a",
        'a = """\n\\"""a.a.a.a.a.a.a.a.a.a"""',
        "a='''\n[[[[[[[[[[['''",
    ],
)
def test_texts_and_comments_do_not_count(text):
    check_bounds(text, "x")


@pytest.mark.parametrize(
    "text", ['x = """' + '\n\\"""' * 150_000, '"""' + '\n\\"""' * 150_000, '"' * 900_000, "x = '''" + "''" * 400_000]
)
def test_an_open_text_is_scanned_once(text):
    check_bounds(text, "x")


@pytest.mark.parametrize(
    "text", ['a = """x"""' + ".a" * 9, "a = [" * 10 + "{" * 10, "a . " * 9 + "a = 1", '"x".' * 9 + "a = 1"]
)
def test_depth_is_counted(text):
    with refused("nested too deeply"):
        check_bounds(text, "x")
