"""Numbers as print has them, and terminal tables as tables for print."""

import pytest
from rich.text import Text

from kinetostat.views.report.content import as_table, typeset
from kinetostat.views.tables import numeric_table, text_table


@pytest.mark.parametrize(
    ("terminal", "print_"),
    [
        ("1.2e-05 m", "1.2×10⁻⁵ m"),
        ("7.4e+11", "7.4×10¹¹"),
        ("-3.5 N, a-b", "−3.5 N, a-b"),
        ("from -20 deg to 30 deg", "from −20° to 30°"),
        ("4e4 N·m**2", "4×10⁴ N·m²"),
        ("3 x 0.0 m", "3 × 0 m"),
        ("6 x 20000000.0 N/m", "6 × 2×10⁷ N/m"),
        ("28000000.0 N", "2.8×10⁷ N"),
        ("50.0 %", "50.0 %"),
        ("leg-e5", "leg-e5"),
        ("(1,681 points)", "(1,681 points)"),
    ],
)
def test_a_number_looks_as_in_print_and_keeps_its_value(terminal, print_):
    assert typeset(terminal) == print_


def test_a_terminal_table_loses_its_colours_and_keeps_its_cells():
    table = numeric_table("title", "part", ["x", "n"])
    table.add_row("leg-1", Text("▼2e-3", "red"), "-1")
    found = as_table(table, "caption", 3)
    assert found.heads == ("part", "x", "n")
    assert found.rows == (("leg-1", "▼2×10⁻³", "−1"),)
    assert found.numeric == (False, True, True)
    assert (found.caption, found.split) == ("caption", 3)


def test_what_is_no_markup_is_kept_as_it_is():
    table = text_table("", "field")
    table.add_row("[/no] markup")
    table.add_row("[bold] neither :smile:")
    assert as_table(table, "").rows == (("[/no] markup",), ("[bold] neither :smile:",))
