"""The studio for everyone, in a real browser: text can be read, the keyboard reaches every control, all of it fits."""

from itertools import combinations
from pathlib import Path

import pytest
from browser import browser, needs_chromium, served

pytestmark = needs_chromium
AUDIT = (Path(__file__).parent / "page_audit.js").read_text("utf-8")
MODES = {"Explore": ".studio:not(.texting, .designing, .asking)", "Design": ".studio.designing"}
"""What a page is that shows them: the server says so some time after a click."""
PROJECTORS = ((1024, 768), (1280, 720), (1280, 800))
"""Widths and heights in pixels of the page; the second is a full HD screen at 150 %."""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with served("zhang-gosselin-4dof", str(tmp_path_factory.mktemp("state"))) as address, browser() as new_tab:
        watched = new_tab()
        watched.open(address)
        watched.tab.evaluate(AUDIT)
        watched.tab.emulate_media(reduced_motion="reduce")
        watched.tab.add_style_tag(content="*, *::before, *::after { transition: none !important; }")
        yield watched
        watched.blameless(address)


def to(page, mode):
    page.tab.get_by_role("button", name=mode, exact=True).click()
    page.tab.locator(MODES[mode]).first.wait_for()
    page.tab.mouse.move(0, 0)


@pytest.mark.parametrize("mode", MODES)
def test_text_is_readable_in_light_and_dark(page, mode):
    to(page, mode)
    for _ in range(2):
        assert page.tab.evaluate("audit.faint()") == []
        dark = page.tab.evaluate("document.body.classList.contains('body--dark')")
        page.tab.get_by_role("button", name="Light or dark").click()
        page.tab.wait_for_function("dark => document.body.classList.contains('body--dark') !== dark", arg=dark)


@pytest.mark.parametrize("mode", MODES)
def test_the_keyboard_reaches_every_control_in_their_order(page, mode):
    to(page, mode)
    assert page.tab.evaluate("audit.unnamed()") == []
    count = page.tab.evaluate("audit.number()")
    page.tab.evaluate("document.activeElement.blur()")
    page.tab.locator(".wordmark").click()
    seen = []
    for _ in range(count):
        page.tab.keyboard.press("Tab")
        seen.append(page.tab.evaluate("audit.focused()"))
    assert [one for one in seen if one is None or not one["ring"]] == []
    assert [one["number"] for one in seen] == list(range(count))


@pytest.mark.parametrize("size", PROJECTORS, ids=lambda size: f"{size[0]} x {size[1]}")
@pytest.mark.parametrize("mode", MODES)
def test_everything_fits(page, mode, size):
    page.tab.set_viewport_size({"width": size[0], "height": size[1]})
    to(page, mode)
    sizes = page.tab.evaluate("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert sizes == list(size)
    for part in (".studio > section:visible", ".headline dd", ".panel-tabs .q-tab__label"):
        for element in page.tab.locator(part).all():
            box = element.bounding_box()
            if box is not None:
                assert box["x"] >= 0.0
                assert box["x"] + box["width"] <= size[0]
                assert box["y"] + box["height"] <= size[1]
    stage = page.tab.locator(".stage").bounding_box()
    assert min(stage["width"], stage["height"]) > 340


NARROW = (390, 844)


def test_on_a_narrow_page_no_label_is_cut_and_the_layers_leave_the_machine_free(page):
    page.tab.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
    to(page, "Explore")
    cut = page.tab.evaluate(
        """[...document.querySelectorAll('.panel-tools .q-field__label, .panel-tabs .q-tab__label, .scene-tools label')]
        .filter(e => e.offsetParent && e.scrollWidth > e.clientWidth + 1).map(e => e.innerText)"""
    )
    assert cut == []
    layers = page.tab.locator(".scene-layers")
    assert not layers.is_visible()
    button = page.tab.get_by_role("button", name="Layers of the picture")
    button.click()
    layers.wait_for(state="visible")
    button.click()
    layers.wait_for(state="hidden")


@pytest.mark.parametrize("width", [390, 1280])
def test_names_of_cables_do_not_lie_on_each_other(page, width):
    """Cables leave their winches in pairs, and the names of a pair would cover each other."""
    tab = page.tab.context.browser.new_page(viewport={"width": width, "height": 800})
    with served("cogiro") as address:
        tab.goto(address)
        tab.wait_for_function("document.querySelectorAll('.machine-label-labels').length === 8")
        tab.wait_for_function("document.querySelector('.machine-view').dataset.rest === 'fine'")
        boxes = tab.evaluate(
            """[...document.querySelectorAll('.machine-label-labels')].map((name) => name.getBoundingClientRect())
            .map((box) => [box.left, box.right, box.top, box.bottom])"""
        )
        tab.close()
    for one, other in combinations(boxes, 2):
        assert one[1] <= other[0] or other[1] <= one[0] or one[3] <= other[2] or other[3] <= one[2]
