"""Layout of figures: names and symbols in their texts, and methods of Matplotlib that are replaced for a while."""

import warnings

import pytest
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from kinetostat.views import layout
from kinetostat.views.figures import set_title
from kinetostat.views.layout import fix_layout, steady_ticks
from kinetostat.views.sensitivity import coloured_table


def test_a_character_without_a_font_is_shown_by_its_number(monkeypatch):
    monkeypatch.setattr(layout, "_known_characters", lambda: frozenset(map(ord, "abc µ")))
    assert layout.drawable_text("ab 機µ") == "ab [U+6A5F]µ"


def test_fonts_that_are_installed_are_used(monkeypatch):
    class Entry:
        name = "Noto Sans CJK SC"

    monkeypatch.setattr(fontManager, "ttflist", [Entry()])
    layout.font_families.cache_clear()
    try:
        assert layout.font_families() == ("DejaVu Sans", "Noto Sans CJK SC")
    finally:
        layout.font_families.cache_clear()


def test_a_name_is_drawn_without_a_warning_and_symbols_stay_mathematics():
    figure = Figure()
    axes = figure.subplots()
    set_title(figure, "a$\\frac$b 並列機構")
    axes.set_title("$K_{\\mathrm{rx}}$")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fix_layout(figure)
    assert figure.get_suptitle().startswith("a$\\frac$b ")
    assert axes.title.get_parse_math()


def test_a_name_with_dollar_signs_is_no_mathematics_in_a_legend_either():
    figure = Figure()
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.plot([1.0, 1e5], [0.0, 1.0], label="leg $\\frac$ 1")
    axes.plot([1.0, 1e5], [1.0, 1.0], label="compliance $C_{\\mathrm{x}}$ (µm/N)")
    legend = axes.legend()
    axes.set_ylabel("$a$ and $b$")
    fix_layout(figure)  # a fraction without numbers is an error where it is read as mathematics
    assert [text.get_parse_math() for text in legend.get_texts()] == [False, True]
    assert not axes.yaxis.label.get_parse_math()
    assert all(label.get_parse_math() for label in axes.get_xticklabels())


def test_names_beside_an_axis_are_drawn_as_they_are_and_fit(monkeypatch):
    monkeypatch.setattr(layout, "_known_characters", lambda: frozenset(range(128)))
    names = ["leg $a$ 1", "脚 of leg " + 40 * "m"]
    figure = coloured_table(("title", "setting"), {name: [1.0] for name in names}, ["x"], "RdBu_r", "percent")
    labels = figure.axes[0].get_yticklabels()
    assert [label.get_text() for label in labels] == [names[0], names[1].replace("脚", "[U+811A]")]
    assert not labels[0].get_parse_math()
    assert all(label.get_window_extent().x0 >= 0.0 for label in labels)


def test_numbers_stay_steady_until_the_outermost_context_ends():
    panel = Figure().subplots()
    own_methods = [{*vars(axis)} for axis in (panel.xaxis, panel.yaxis)]
    with steady_ticks([panel]):
        steady = [{*vars(axis)} for axis in (panel.xaxis, panel.yaxis)]
        with steady_ticks([panel]):
            pass
        assert [{*vars(axis)} for axis in (panel.xaxis, panel.yaxis)] == steady != own_methods
    assert [{*vars(axis)} for axis in (panel.xaxis, panel.yaxis)] == own_methods


def test_a_layout_that_fails_leaves_the_panels_as_they_were(monkeypatch):
    figure = Figure(layout="constrained")
    panel = figure.subplots()
    monkeypatch.setattr(figure.get_layout_engine(), "execute", lambda _figure: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        fix_layout(figure)
    assert "get_tightbbox" not in vars(panel)
