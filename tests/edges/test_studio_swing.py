"""The studio's view of vibrations in a real browser: a mode swings, stops and waits, and a table chooses another."""

from contextlib import contextmanager

import pytest
from browser import browser, needs_chromium, served

pytestmark = needs_chromium
SHARE = "parseFloat(document.querySelector('.machine-view').dataset.share)"
SWINGS = "document.querySelector('.machine-view').dataset.swings"
ADDRESS = "?machine=hexapod&tool.mass=12+kg&linear_density.legs=4+kg%2Fm"


@pytest.fixture(scope="module")
def address():
    with served("hexapod") as found:
        yield found


@pytest.fixture(scope="module")
def new_tab():
    with browser() as opening:
        yield opening


@contextmanager
def opened(new_tab, address, **media):
    """A tab with the view of vibrations in front, once its mode is in the picture; closed, because a mode swings on."""
    page = new_tab()
    page.tab.emulate_media(**media)
    page.open(address + ADDRESS)
    page.tab.get_by_role("tab", name="Vibration").click()
    page.tab.wait_for_function(f"{SWINGS}")
    yield page
    page.blameless(address)
    page.tab.close()


def test_a_mode_swings_until_it_is_paused_and_only_while_its_tab_is_in_front(new_tab, address):
    with opened(new_tab, address) as page:
        tab, play = page.tab, page.tab.get_by_role("button", name="Play or pause the mode")
        tab.wait_for_function(f"{SWINGS} === 'true' && {SHARE} < -0.3")
        tab.wait_for_function(f"{SHARE} > 0.3")
        play.click()
        tab.wait_for_function(f"{SWINGS} === 'false'")
        paused = tab.evaluate(SHARE)
        drawn = tab.evaluate("document.querySelector('.machine-view').dataset.drawn")
        tab.get_by_role("button", name="front", exact=True).click()
        tab.wait_for_function("drawn => document.querySelector('.machine-view').dataset.drawn > drawn", arg=drawn)
        assert tab.evaluate(SHARE) == paused
        play.click()
        tab.wait_for_function(f"share => {SWINGS} === 'true' && {SHARE} !== share", arg=paused)
        tab.get_by_role("tab", name="Loads").click()
        tab.wait_for_function(f"{SWINGS} === ''")
        tab.get_by_role("tab", name="Vibration").click()
        tab.wait_for_function(f"{SWINGS} === 'true'")


def test_the_keyboard_chooses_a_mode_and_the_response_marks_it(new_tab, address):
    with opened(new_tab, address) as page:
        tab = page.tab
        before = page.text(".vibration .note")
        row = tab.get_by_role("button", name="show mode 3", exact=True)
        row.focus()
        tab.keyboard.press("Enter")
        page.until_changed(".vibration .note", before)
        tab.wait_for_function("document.querySelector('.vibration tr.chosen th').innerText === '3'")
        tab.get_by_role("button", name="Response", exact=True).click()
        third = page.text(".vibration .note")
        tab.locator(".vibration .plot canvas").first.click(position={"x": 70, "y": 60})
        assert page.until_changed(".vibration .note", third) == before


def test_nothing_moves_for_who_wants_less_motion_until_it_is_asked_for(new_tab, address):
    with opened(new_tab, address, reduced_motion="reduce") as page:
        tab = page.tab
        assert tab.evaluate(SWINGS) == "false"
        tab.get_by_role("button", name="Play or pause the mode").click()
        tab.wait_for_function(f"{SWINGS} === 'true' && {SHARE} < 0.9")
