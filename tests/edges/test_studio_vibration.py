"""The studio's view of vibrations, without a browser: what it asks for and shows, and what swings in the picture."""

import numpy as np
import pytest
from studio_page import on_page

from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import load
from kinetostat.studies.attribution import ranking_of
from kinetostat.studies.vibration import modes
from kinetostat.studio.answers import SwingRequest, modes_and_response, swing
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.vibration import percent

MASSES = ("tool.mass=12", "tool.inertia=[0.3, 0.3, 0.5, 0, 0, 0]", "linear_density.legs=4")


def test_a_machine_without_mass_is_given_one_and_rings():
    async def steps(page):
        await page.front("Vibration")
        assert "Give the mass of platform and tool here" in page.one("vibration-about").content
        assert not any("frequency" in name for name in page.one("map-quantity").options.values())
        await page.send("vibration-mass", "write", "12 parsnips")
        assert "parsnips" in page.one("vibration-mass")._props["problem"]
        await page.send("vibration-mass", "write", "12 kg")
        answer = modes(load("hexapod", ["tool.mass=12"]))
        assert answer.message in page.one("vibration-about").content
        assert not page.one("vibration-mass").visible
        assert page.one("control tool.mass")._props["text"] == "12 kg"
        rows = page.one("vibration-table")._props["texts"]
        assert [row[0] for row in rows] == [f"{mode.frequency:.4g} Hz" for mode in answer.modes]
        await page.send("undo", "click")
        assert page.one("vibration-mass").visible
        assert page.shown("MachineView", "swing") == []

    on_page(steps, "hexapod")


def test_a_row_chooses_the_mode_that_swings_and_whose_energies_are_shown():
    async def steps(page):
        await page.front("Vibration")
        answer = modes(load("hexapod", MASSES))
        first = page.shown("MachineView", "swing")
        await page.send("vibration-table", "pick", 2)
        assert page.shown("MachineView", "swing") != first
        assert page.one("vibration-table")._props["chosen"] == 2
        strain = ranking_of(answer.modes[2].strain)[0]
        energies = page.one("vibration-energies").content
        assert energies.index(strain[0]) < energies.index(f"{percent(strain[1])} %")
        assert page.one("vibration-mode").text == f"mode 3, {answer.modes[2].frequency:.4g} Hz"
        await page.front("Loads")
        assert page.shown("MachineView", "swing") == []
        await page.front("Vibration")
        assert page.shown("MachineView", "swing") != []
        await page.choose("mode", "Design")
        assert page.shown("MachineView", "swing") == []

    on_page(steps, "hexapod", MASSES)


def test_the_response_is_the_receptance_that_was_chosen():
    async def steps(page):
        await page.front("Vibration")
        await page.choose("vibration-kind", "Response")
        answer = modes(load("hexapod", MASSES))
        for chosen, way in (("z", (0, 0, 1)), ("the cut", (3, 4, 0))):
            await page.choose("vibration-moved", chosen)
            await page.choose("vibration-pushed", chosen)
            size, phase = (args[0] for name, _, args in page.calls[-2:] if name == "CurveView")
            expected = answer.along(way, size["x"])
            assert size["unit"] == "µm/N"
            assert size["lines"][0]["values"] == pytest.approx(1e6 * np.abs(expected), abs=1e-3)
            assert phase["lines"][0]["values"] == pytest.approx(np.degrees(np.angle(expected)), abs=0.5)
            assert size["marks"] == [mode.frequency for mode in answer.modes]
        await page.send("vibration-size", "pick", 1)
        assert page.one("vibration-table")._props["chosen"] == 1

    on_page(steps, "hexapod", (*MASSES, "cutting.direction=[3, 4, 0]"))


def test_the_map_shows_frequencies_of_the_state_that_is_shown():
    async def steps(page):
        await page.choose("map-quantity", "frequency_1")
        free = page.shown("MapView", "show")
        middle = free["values"][len(free["values"]) // 2]
        assert free["unit"] == "Hz"
        there = [0.5 * (free[axis]["low"] + free[axis]["high"]) for axis in "xy"]
        machine = load("hexapod", [*MASSES, *(f"pose.{axis}={at} mm" for axis, at in zip("xy", there, strict=True))])
        assert middle == pytest.approx(modes(machine).modes[0].frequency, rel=1e-9)
        await page.choose("loaded", True)
        assert page.one("map-quantity").value == "loaded_frequency_1"
        assert page.shown("MapView", "show")["values"] != free["values"]
        await page.send("control tool.mass", "write", "24 kg")
        assert page.shown("MapView", "show")["values"][len(free["values"]) // 2] < 0.95 * middle

    on_page(steps, "hexapod", (*MASSES, "load.gravity=[0, 0, -9.81]"))


def test_a_rotor_without_transmission_is_said_where_its_frequencies_are_asked_for():
    async def steps(page):
        await page.front("Vibration")
        await page.choose("map-quantity", "frequency_1")
        for mark, said in (("map-time", "text"), ("vibration-about", "content")):
            assert "nothing says how far a rotor turns" in getattr(page.one(mark), said)
        assert not page.one("vibration-mass").visible
        assert page.shown("MachineView", "swing") == []

    on_page(steps, "hexapod", (*MASSES, "drives.rotor_inertia=2e-5"))


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "planar-3rrr", "delta"])
def test_a_swing_goes_through_the_machine_as_it_is_and_as_far_as_a_deflection(name):
    machine = load(name, ["tool.mass=3"])
    configuration = respond(machine).configuration
    sizes, answer = proportions_of(machine, configuration), modes_and_response(machine).answer
    for number in range(len(answer.modes)):
        solids = swing(SwingRequest(answer, number, sizes))
        wires = [solid for solid in solids if solid["shape"]["kind"] == "swept"]
        bodies = [solid for solid in solids if solid["shape"]["kind"] != "swept"]
        moved = [np.linalg.norm(solid["ends"], axis=1).max() for solid in wires]
        assert len(wires[0]["ends"]) == len(wires[0]["shape"]["path"])
        assert 0.02 * sizes.diagonal < max(moved) < 0.12 * sizes.diagonal
        for body in bodies:
            there, back = np.array(body["ends"])
            assert (there + back)[:9] / 2 == pytest.approx(np.array(body["place"])[:9], abs=0.2)
