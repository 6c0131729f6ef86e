"""A report in a real browser: the machine turns, nothing is asked for, dark and printed pages show what they should."""

from io import BytesIO

import pytest
from browser import browser, needs_chromium
from PIL import Image
from report_pages import MACHINE, QUICK, reported, small_pictures

pytestmark = needs_chromium

DRAWN = "document.querySelector('.machine-view')?.dataset.rest === 'fine'"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A report, opened as a file, with the machine drawn."""
    with pytest.MonkeyPatch.context() as patch:
        small_pictures(patch)
        file = tmp_path_factory.mktemp("report") / "r.html"
        given = ("--set", 'load.force=["0 N","0 N","-500 N"]', "--set", "tool.mass=40 kg")
        reported(file, MACHINE, *QUICK, "--without", "maps", *given)
    with browser() as new_tab:
        page = new_tab(width=640, height=640)
        page.tab.goto(file.as_uri())
        page.tab.wait_for_function(DRAWN)
        yield page
        assert page.complaints == []
        assert page.hosts == {""}, "a file, and what it holds itself"


def shot(page):
    """What the view of the machine shows."""
    page.tab.wait_for_function(DRAWN)
    return page.tab.locator("#live").screenshot()


def test_the_machine_is_there_and_follows_its_buttons(page):
    before = shot(page)
    image = Image.open(BytesIO(before)).convert("RGB")
    assert len(image.getcolors(image.width * image.height)) > 500
    assert int(page.tab.locator(".machine-view").get_attribute("data-solids")) > 10
    page.tab.get_by_role("button", name="top").click()
    above = shot(page)
    assert above != before
    page.tab.get_by_label("deflected shape").uncheck()
    assert shot(page) != above


def test_a_mode_of_vibration_swings_until_it_is_paused(page):
    view, modes = page.tab.locator(".machine-view"), page.tab.get_by_role("combobox")
    assert modes.locator("option").first.inner_text() == "none"
    modes.select_option(index=1)
    page.tab.wait_for_function("document.querySelector('.machine-view').dataset.share < 0.5")
    page.tab.get_by_role("button", name="pause").click()
    assert view.get_attribute("data-swings") == "false"
    page.tab.get_by_role("button", name="play").click()
    assert view.get_attribute("data-swings") == "true"
    modes.select_option(label="none")
    assert view.get_attribute("data-swings") == ""
    assert page.tab.get_by_role("button", name="pause").count() == 0


def test_it_is_dark_where_people_like_it_dark_and_light_on_paper(page):
    ground = "getComputedStyle(document.body).backgroundColor"
    light = page.tab.evaluate(ground)
    page.tab.emulate_media(color_scheme="dark")
    assert page.tab.evaluate(ground) == "rgb(21, 26, 33)"
    assert page.tab.locator("#live").is_visible()
    assert not page.tab.locator(".still img").first.is_visible()
    page.tab.emulate_media(media="print", color_scheme="dark")
    assert page.tab.evaluate(ground) == light == "rgb(255, 255, 255)"
    assert page.tab.locator(".still img").first.is_visible()
    assert not page.tab.locator("#live").is_visible()
    page.tab.emulate_media(media="screen", color_scheme="light")


def test_a_narrow_page_does_not_scroll_sideways(page):
    page.tab.set_viewport_size({"width": 400, "height": 640})
    page.tab.wait_for_function("document.documentElement.scrollWidth <= 400")
    tables = "[...document.querySelectorAll('table')].filter(table => table.caption?.innerText.includes('All values'))"
    (width,) = page.tab.evaluate(f"{tables}.map(table => table.getBoundingClientRect().right)")
    assert width <= 400, "the data sheet is read without pushing it"
