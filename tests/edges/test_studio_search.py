"""The design tab in a real browser: a study is sent, searched, watched; its answer is that of the command."""

import io
import json

import pytest
from browser import browser, needs_chromium, served
from matplotlib import image

from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.display import number
from studies import SMALL

pytestmark = needs_chromium
STUDY = SMALL + "[optimizer]\npopulation = 16\ngenerations = 12\nseed = 3\n"
FRONT = STUDY + '[[objectives]]\nquantity = "compliance_z"\n[[objectives]]\nquantity = "stiffness_x"\n'


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with served("zhang-gosselin-4dof", str(tmp_path_factory.mktemp("state"))) as address, browser() as new_tab:
        watched = new_tab()
        watched.open(address)
        watched.tab.get_by_role("button", name="Design", exact=True).click()
        yield watched
        watched.blameless(address)


@pytest.fixture
def told(tmp_path, capsys):
    """What the command says of a study."""

    def optimised(text):
        file = tmp_path / "study.toml"
        file.write_text(text)
        assert main(["optimize", str(file), "--json"]) == DONE
        return json.loads(capsys.readouterr().out)

    return optimised


def searched(page, text):
    """Send a study, start it, and wait for its answer; what was said on the way."""
    sender = page.tab.locator("section.design input[type=file]")
    sender.set_input_files({"name": "small.toml", "mimeType": "application/toml", "buffer": text.encode()})
    page.tab.locator(".form-text input").first.wait_for()
    page.tab.wait_for_function(
        "wanted => document.querySelectorAll('.form-aim').length === wanted", arg=text.count("[[objectives]]")
    )
    page.tab.get_by_role("button", name="Start", exact=True).click()
    page.tab.wait_for_function("document.querySelector('.run-line').innerText.startsWith('running')")
    page.tab.wait_for_function("document.querySelector('.run-line').innerText.startsWith('done')")
    return page.text(".run-line")


def ink(page, where):
    """How many points of a plot differ from its ground."""
    picture = image.imread(io.BytesIO(page.tab.locator(where).screenshot()))[:, :, :3]
    return int((abs(picture - picture[2, 2]).max(axis=2) > 0.3).sum())


def sizes(page, geometry):
    """The machine's own numbers, as the sliders have them, mm."""
    page.tab.get_by_role("button", name="Explore", exact=True).click()
    page.tab.get_by_role("tab", name="Geometry", exact=True).click()
    for path, value in geometry.items():
        label = path.removeprefix("geometry.").replace("_", " ")
        box = page.tab.get_by_label(f"{label}, value with unit", exact=True)
        page.tab.wait_for_function(
            "([box, text]) => box.value === text", arg=[box.element_handle(), f"{1e3 * value:.6g} mm"]
        )
    page.tab.get_by_role("button", name="Design", exact=True).click()


def test_a_search_ends_where_the_command_ends(page, told):
    said = searched(page, STUDY)
    expected = told(STUDY)
    best = number(expected["objective"], digits=9)
    assert said == f"done: 12 of 12 steps, {expected['evaluations']:,} designs, best {best}"
    assert ink(page, ".run-card .plot:visible canvas") > 1500
    cells = page.text(".answer-card table.figures tbody").split()
    assert best in cells
    page.tab.get_by_role("button", name="Load the best design").click()
    sizes(page, expected["variables"])


def test_a_front_is_drawn_and_its_designs_load(page, told):
    searched(page, FRONT)
    expected = told(FRONT)["front"]
    assert int(page.tab.locator(".front-plot .plot").get_attribute("data-points")) == len(expected)
    assert ink(page, ".front-plot canvas") > 3000
    page.tab.get_by_role("tab", name="Front", exact=True).click()
    row = page.tab.get_by_role("button", name="load design 2", exact=True)
    row.press("Enter")
    page.tab.wait_for_function("row => row.getAttribute('aria-pressed') === 'true'", arg=row.element_handle())
    sizes(page, expected[1]["variables"])
