"""The studio's switch to the machine under its loads: what is drawn, said and offered then, without a browser."""

import re
from pathlib import Path

import numpy as np
import pytest
from studio_page import on_page
from test_state_of_load import CABLES

from kinetostat.display import with_minus_signs
from kinetostat.machine.loading import as_toml, load
from kinetostat.studies.under_load import under_load
from kinetostat.studio.addresses import address_of, memory_of
from kinetostat.studio.session import Memory, Session

DOWN = ("control load.force.2", "write", "-400 N")


def test_the_switch_shows_the_machine_at_rest_and_offers_what_loads_it():
    async def steps(page):
        await page.send(*DOWN)
        await page.send("control load.force.0", "write", "100 N")
        free = page.shown("MachineView", "overlay")
        with pytest.raises(ValueError, match="unpack"):
            page.one("control load.gravity.2")
        await page.choose("loaded", True)
        await page.front("Loads")
        state = under_load(load("hexapod", ["load.force=[100, 0, -400]"]))
        assert page.one("status").text == "under load: ok"
        assert with_minus_signs(f"{state.displacement[5] * 1e6:.4g}") in page.one("headline").content
        bars = re.findall(r'class="bar-fill [a-z]*" style="width:([\d.]+)%', page.one("under-load").content)
        loads = [abs(spring.load) for spring in state.springs]
        np.testing.assert_allclose(
            [float(bar) for bar in bars], [100.0 * load / max(loads) for load in loads], atol=0.01
        )
        overlay = page.shown("MachineView", "overlay")
        assert overlay != free
        assert {solid["layer"] for solid in overlay} == {"load", "deflection"}
        assert page.one("control load.gravity.2")._props["text"] == "0 m/s²"
        await page.choose("loaded", False)
        assert page.one("status").text == "ok"
        assert page.shown("MachineView", "overlay") == free

    on_page(steps, "hexapod")


def test_gravity_moves_the_tool_and_what_is_missing_is_said():
    async def steps(page):
        await page.choose("loaded", True)
        await page.send("control load.gravity.2", "write", "-9.81 m/s**2")
        assert page.one("status").text == "no answer"
        assert "load.gravity pulls at masses, but none is known" in page.one("message").text
        await page.send("control tool.mass", "write", "20 kg")
        assert page.one("status").text == "under load: ok"
        state = under_load(load("hexapod", ["load.gravity=[0, 0, -9.81]", "tool.mass=20"]))
        assert with_minus_signs(f"{state.displacement[5] * 1e6:.4g}") in page.one("headline").content
        upright = page.one("headline").content
        await page.send("control load.gravity_angle", "write", "90 deg")
        assert page.one("headline").content != upright

    on_page(steps, "hexapod")


def test_the_switch_is_a_step_of_the_history_and_stays_when_the_page_is_loaded_again():
    async def steps(page):
        await page.choose("loaded", True)
        await page.send("undo", "click")
        assert page.one("loaded").value is False
        assert page.one("status").text == "ok"
        await page.send("redo", "click")
        assert page.one("loaded").value is True
        assert page.one("status").text == "under load: ok"
        await page.again()
        assert page.one("loaded").value is True
        assert page.one("control load.gravity.0").visible

    on_page(steps, "hexapod")


def test_cables_that_only_tension_holds_are_shown_with_their_tensions():
    """Upright cables are stiff in no direction across them, so that the free machine is singular and the loaded not."""

    async def steps(page):
        await page.upload("cables.toml", CABLES.encode())
        assert page.one("status").text == "under load: ok"
        await page.front("Loads")
        bars = page.one("under-load").content
        assert bars.count(">300 N<") >= 2
        await page.send("control load.min_tension", "write", "none")
        assert "Slack, so that they carry nothing: c, d." in page.one("message").text
        assert page.one("under-load").content.count('class="bar-value">slack<') == 2

    on_page(steps)


def test_springs_are_grouped_as_the_terminal_groups_them():
    """Thirty springs of six legs under weight have a line for each kind; a free machine shows its actuators."""
    telescope = (Path(__file__).parents[1] / "cases" / "telescope-weight.toml").read_text("utf-8")

    async def steps(page):
        await page.upload("telescope.toml", telescope.encode())
        await page.front("Loads")
        content = page.one("under-load").content
        assert "×6" in content.partition("Springs")[2]
        assert "leg 3" not in content.partition(">Springs<")[2]

    on_page(steps)


def test_a_load_without_rest_is_said_and_the_last_figures_stay():
    async def steps(page):
        await page.upload("cables.toml", CABLES.encode())
        figures = page.one("headline").content
        await page.send("control pose.x", "write", "50 cm")
        assert page.one("status").text == "under load: no rest"
        assert "No tensions of 50 N or more hold this load" in page.one("message").text
        assert "The picture shows the machine without its loads" in page.one("message").text
        assert page.shown("MachineView", "overlay") == []
        assert page.one("headline").content == figures

    on_page(steps)


def test_an_address_keeps_the_state():
    session = Session(Memory(load("hexapod"), "hexapod"))
    session.show_loaded(True)
    assert address_of(session.memory) == "machine=hexapod&load.state=loaded"
    again = memory_of([("machine", "hexapod"), ("load.state", "loaded"), ("pose.x", "1 cm")]).now
    assert again.loaded
    assert as_toml(again) == as_toml(load("hexapod", ["load.state=loaded", "pose.x=1 cm"]))
