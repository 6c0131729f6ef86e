"""Names in figures: characters that no font has are shown by number, and dollar signs are dollar signs."""

import warnings

from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from kinetostat.views import lettering
from kinetostat.views.figures import fix_layout


def test_a_character_without_a_font_is_shown_by_its_number(monkeypatch):
    monkeypatch.setattr(lettering, "_known", lambda: frozenset(map(ord, "abc µ")))
    assert lettering.drawable("ab 機µ") == "ab [U+6A5F]µ"


def test_fonts_that_are_installed_are_used(monkeypatch):
    class Entry:
        name = "Noto Sans CJK SC"

    monkeypatch.setattr(fontManager, "ttflist", [Entry()])
    lettering.families.cache_clear()
    try:
        assert lettering.families() == ("DejaVu Sans", "Noto Sans CJK SC")
    finally:
        lettering.families.cache_clear()


def test_a_name_with_two_dollars_is_no_mathematics_and_powers_of_ten_stay():
    figure = Figure()
    axes = figure.subplots()
    axes.set_title("a$\\frac$b 並列機構")
    axes.set_xscale("log")
    axes.plot([1.0, 1e6], [1.0, 2.0], label="$x$ leg")
    axes.legend()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fix_layout(figure)
    assert axes.get_title().startswith("a$\\frac$b ")
    assert not axes.title.get_parse_math()
    assert all(label.get_parse_math() for label in axes.get_xticklabels() if "mathdefault" in label.get_text())
