"""Machines and answers through IPython's own formatter: tables with units, pictures, nothing from elsewhere."""

import base64
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest
from IPython.core.interactiveshell import InteractiveShell

import kinetostat
from kinetostat import analyze, changed, compare, evaluate_grid, load, machine_picture, plot, workspace
from kinetostat.views import notebook

VOID = {"img", "br"}


class Reader(HTMLParser):
    """A piece of HTML as its tables and words; fails where an element is not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.words, self.images = [], [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "img":
            self.images.append(dict(attrs))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data
        elif "style" not in self.open:
            self.words.append(data)


@pytest.fixture(scope="module")
def shell():
    running = InteractiveShell.instance()
    kinetostat.load_ipython_extension(running)
    yield running
    InteractiveShell.clear_instance()


@pytest.fixture
def shown(shell, monkeypatch):
    """Everything is shown by IPython's formatter, machines in small pictures, which take longest."""
    monkeypatch.setattr(notebook, "PICTURE_PIXELS", (160, 120))
    return lambda thing: shell.display_formatter.format(thing)[0]


def test_a_machine_shows_its_picture_and_its_fields(shown):
    page = Reader(shown(load("planar-3rpr"))["text/html"])
    (picture,) = page.images
    data = base64.b64decode(picture["src"].removeprefix("data:image/png;base64,"))
    assert data.startswith(b"\x89PNG")
    assert picture["alt"] == load("planar-3rpr").name
    assert any(row[0] == "geometry.base_radius" and row[1].endswith(" mm") for row in page.rows)


def test_an_analysis_shows_the_numbers_of_the_terminal_with_their_units(shown):
    found = analyze(load("planar-3rpr", ["load.force=[5, 0, 0]"]))
    page = Reader(shown(found)["text/html"])
    said = " ".join(page.words)
    assert "Stiffness K (N·m/µrad, N/µrad, N/µm)" in said
    assert "Actuators under this load" in said
    matrix = [row for row in page.rows if row[0] == "rz" and len(row) == 4]
    assert float(matrix[0][1]) == pytest.approx(1e-6 * found.stiffness[0][0], rel=1e-3)
    assert len(page.images) == 1


def test_brackets_are_no_markup(shown):
    page = Reader(shown(analyze(load("planar-3rpr", ["name=a [/b] [bold]c"])))["text/html"])
    assert "a [/b] [bold]c" in " ".join(page.words)


def test_a_pose_without_an_answer_says_why_and_has_no_picture(shown):
    page = Reader(shown(analyze(load("delta", ["pose.z=-30 m"])))["text/html"])
    assert "out_of_reach" in " ".join(page.words)
    assert "cannot be drawn" in " ".join(page.words)
    assert not page.images


def test_designs_and_a_workspace_show_tables_and_figures(shown):
    machine = load("planar-3rpr")
    html = shown(compare({"a<b": machine, "other": changed(machine, {"pose.x": 0.01})}))["text/html"]
    assert "a&lt;b" in html
    page = Reader(html)
    assert ["pose.x", "20 mm", "10 mm"] in page.rows
    assert [image["class"] for image in page.images] == ["figure"]
    area = Reader(shown(workspace(machine, ["x=-2 cm:2 cm:5", "y=-2 cm:2 cm:5"]))["text/html"])
    assert [row for row in area.rows if row[0] == "Area"]
    assert [row for row in area.rows if row[0] == "inside"]


def test_figures_and_pictures_show_themselves(shown):
    grid = evaluate_grid(load("planar-3rpr"), ["x=-1 cm:1 cm:3"])
    assert shown(plot(grid))["image/png"].startswith(b"\x89PNG")
    assert shown(machine_picture(load("planar-3rpr"), (32, 32)))["image/png"].startswith(b"\x89PNG")


def test_nothing_is_fetched_and_the_page_keeps_its_own_colours(shown):
    html = shown(analyze(load("planar-3rpr")))["text/html"]
    assert not re.search(r"https?:|<script|<link|@import|url\(", html)
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL)[1]
    assert all(rule.startswith(".kinetostat") for rule in re.findall(r"(?:^|})\s*([^{}]+){", style))
    assert "color:#000" not in style
    assert "color:inherit" in style


def test_importing_in_a_notebook_is_enough_and_loads_only_the_list_of_answers():
    code = (
        "import sys; from IPython.core.interactiveshell import InteractiveShell as S; s = S.instance();"
        "import kinetostat; print([m for m in sys.modules if m.startswith('kinetostat.')]);"
        "from kinetostat import analyze, load; there = analyze(load('delta', ['pose.z=-30 m']));"
        "print('kinetostat' in s.display_formatter.format(there)[0]['text/html'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = ["kinetostat.views", "kinetostat.views.questions"]
    assert done.stdout.split("\n")[:2] == [str(loaded), "True"]
