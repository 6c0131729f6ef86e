"""The studio's view of drives, without a browser: a motion that is sent or named, its curves, and the machine on it."""

import asyncio

import numpy as np
import pytest
from nicegui import ui
from studio_page import on_page

from kinetostat.machine.loading import as_toml, load
from kinetostat.studies.drives import drives
from kinetostat.studies.motions import read_motion
from kinetostat.studio.playback import FRAMES, NO_MOTION, CurveKind, plot_of

MASSES = ("tool.mass=12 kg", "drives.lead=10 mm", "load.gravity=[0, 0, -9.81]")
SINE = "field, amplitude, frequency [Hz]\nx, 5 mm, 4\nz, 2 mm, 8\n"
NAMED = '[requirements]\nservo.fits = "yaskawa-sgmp-03b"\nservo.motion = """\n' + SINE + '"""\n'


def test_a_motion_that_is_sent_is_drawn_and_the_machine_follows_the_slider(tmp_path):
    async def steps(page):
        await page.front("Drives")
        assert NO_MOTION in page.one("drives-about").content.replace("&quot;", '"')
        await page.upload("shake.csv", SINE.encode(), "drives-upload")
        machine = load("hexapod", MASSES)
        answer = drives(machine, read_motion(machine, tmp_path, text=SINE))  # as the command does
        assert answer.message in page.one("drives-about").content
        shown = page.shown("CurveView", "show")
        assert len(shown["lines"]) == 6
        assert max(map(abs, shown["lines"][0]["values"])) == pytest.approx(answer.drives[0].force, rel=1e-3)
        page.one("drives-place").set_value(FRAMES // 4)
        await page.settled()
        there = answer.motion.times[-1] / 4.0
        x = np.interp(there, answer.motion.times, answer.motion.path.pose["x"])
        assert page.shown("CurveView", "mark") == pytest.approx(there, rel=0.02)
        assert float(page.one("control pose.x")._props["text"].split()[0]) == pytest.approx(1e3 * x, abs=0.2)
        assert answer.message in page.one("drives-about").content, "a pose on the way asks for no new answer"
        page.one("drives-place").set_value(FRAMES - 2)
        await page.settled()
        await page.send("drives-play", "click")
        while page.one("drives-place").value < FRAMES:
            await asyncio.sleep(0)  # the timer of the page moves it
        await page.settled()
        assert page.shown("CurveView", "mark") == pytest.approx(answer.motion.times[-1])

    on_page(steps, "hexapod", MASSES)


def test_a_mistake_in_a_motion_is_said():
    async def steps(page):
        await page.front("Drives")
        await page.upload("shake.csv", b"field, frequency [Hz]\nx, 4\n", "drives-upload")
        assert "no column amplitude" in page.one("drives-about").content

    on_page(steps, "hexapod", MASSES)


def test_the_motion_of_a_requirement_is_drawn_at_once(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(as_toml(load("hexapod", MASSES)) + NAMED, "utf-8")

    async def steps(page):
        await page.front("Drives")
        assert "the motors give up to" in page.one("drives-about").content

    on_page(steps, str(path))


def test_every_kind_of_curve_has_its_unit(tmp_path):
    machine = load("hexapod", MASSES)
    answer = drives(machine, read_motion(machine, tmp_path, text=SINE))  # as the command does
    times = answer.motion.times[::10]
    units = {}
    for kind in CurveKind:
        label, units[kind], lines = plot_of(answer, kind, times)
        assert units[kind] in label
        assert all(len(row) == len(times) for _, row in lines)
    assert units == {"Force": "N", "Speed": "mm/s", "Motor": "N·m", "Power": "W", "Tool": "µm"}
    torque = plot_of(answer, CurveKind.MOTOR, times).lines[2][1]
    assert torque == pytest.approx(answer.curves.motor_torque[2][::10])


def test_what_is_played_waits_for_the_browser_so_that_a_pause_is_one():
    """Poses that the server sends before the browser has drawn the last one would still come after the pause."""

    async def steps(page):
        await page.upload("poses.csv", b"x [mm]\n0\n1\n2\n3\n", "path-upload")
        view, place = page.one("machine"), page.one("path-place")
        await page.send("machine", "drawn", view._sent)
        await page.send("path-play", "click")
        await page.glance()
        assert place.value == 1
        for _ in range(3):
            await page.glance()
        assert place.value == 1, "the browser has not drawn it"
        await page.send("machine", "drawn", view._sent)
        await page.glance()
        assert place.value == 2
        await page.send("path-play", "click")
        assert not [e for e in page.user.client.elements.values() if isinstance(e, ui.timer) and e.active]

    on_page(steps, "hexapod")
