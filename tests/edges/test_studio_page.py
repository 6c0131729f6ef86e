"""Sliders, fields, maps and panels of the studio, driven without a browser: numbers as `analyze` has them, history."""

import asyncio
import json
import math
from threading import Event

import pytest
from studio_page import on_page

from kinetostat.cli import main
from kinetostat.kinematics import nearest
from kinetostat.kinematics.nearest import nearest_pose
from kinetostat.machine.loading import bundled, load
from kinetostat.studies.analysis import analyze
from kinetostat.studio import answers, lanes
from kinetostat.studio import page as page_of_a_tab
from kinetostat.studio.panels.tables import matrix_text
from kinetostat.studio.scene_panel import ScenePanel
from machines import KINDS

MACHINE = "zhang-gosselin-4dof"
RESCUE = 20
"""Seconds after which a computation that waits for the page goes on, so that a test fails instead of hanging."""


def analysed(capsys, *settings):
    """What `kinetostat analyze --json` says."""
    main(["analyze", MACHINE, "--json", *(word for setting in settings for word in ("--set", setting))])
    return json.loads(capsys.readouterr().out)


def test_the_page_shows_what_analyze_says(capsys):
    found = analysed(capsys)

    async def steps(page):
        assert page.one("status").text == "ok"
        headline = page.one("headline").content
        assert "0.9452 <small>m/N</small>" in headline
        await page.choose("matrix-kind", "C")
        await page.front("Matrices")
        table = page.one("matrix-table").content
        assert "<td>0.9452</td>" in table
        copied = matrix_text(analyze(load(MACHINE)), "C")
        assert [[float(cell) for cell in line.split("\t")] for line in copied.splitlines()] == found["compliance"]

    on_page(steps)


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_machine_opens(name):
    async def steps(page):
        assert page.one("status").text == "ok"
        assert len(page.shown("MachineView", "show")["solids"]) > 20
        assert any(value is not None for value in page.shown("MapView", "show")["values"])
        assert "<li data-leg=" in page.one("contributions-bars").content

    on_page(steps, name)


def test_a_slider_moves_everything(capsys):
    async def steps(page):
        before = page.shown("MachineView", "show")
        await page.send("control pose.z", "slide", 700)
        await page.send("control pose.z", "settle")
        z = page.one("control pose.z")._props
        assert z["text"] == f"{680 + 0.75 * 170 * 0.4:.6g} mm"
        assert page.shown("MachineView", "show")["solids"] != before["solids"]
        here = page.shown("MapView", "show")["here"]
        assert here[1] == pytest.approx(680 + 0.75 * 170 * 0.4)
        assert "poses in" in page.one("map-time").text
        found = analysed(capsys, f"pose.z={0.68 + 0.75 * 0.17 * 0.4!r}")
        assert f"{found['compliance_diagonal'][3]:.4g}" in page.one("headline").content

    on_page(steps)


def test_values_can_be_typed_in_any_unit():
    async def steps(page):
        await page.send("control pose.x", "write", "1.5 cm")
        assert page.one("control pose.x")._props["text"] == "15 mm"
        await page.send("control pose.x", "write", "20")
        assert page.one("control pose.x")._props["text"] == "20 mm"
        await page.send("control pose.x", "write", "10+5 mm")
        assert page.one("control pose.x")._props["text"] == "15 mm"
        await page.send("control stiffness.passive_links.0", "write", "rigid")
        assert page.one("control stiffness.passive_links.0")._props["text"] == "rigid"
        await page.send("control stiffness.actuator", "write", "3 N/mm")
        assert page.one("control stiffness.actuator.2")._props["text"] == "3000 N/m"

    on_page(steps)


def test_what_is_no_value_is_refused_at_its_place():
    async def steps(page):
        await page.send("control geometry.base_radius", "write", "5 parsnips")
        row = page.one("control geometry.base_radius")._props
        assert "parsnips" in row["problem"]
        assert row["text"] == "220 mm"
        await page.send("control geometry.base_radius", "write", "23 cm")
        assert page.one("control geometry.base_radius")._props["problem"] == ""

    on_page(steps)


def test_a_pose_out_of_reach_says_at_once_that_the_nearest_is_looked_for(monkeypatch):
    """The nearest pose is not there before all else has been answered."""
    answered = Event()

    def patient(machine):
        answered.wait(RESCUE)
        return nearest_pose(machine)

    monkeypatch.setattr(nearest, "nearest_pose", patient)

    async def steps(page):
        try:
            figures = page.one("headline").content
            refused = asyncio.create_task(page.send("control pose.x", "write", "3 m"))
            await asyncio.sleep(0)
            await page.until(lambda: page.one("status").text == "out of reach")
            assert "is being looked for" in page.one("message").text
            page.one("map-quantity").value = "compliance_rx"
            shown = len(page.calls)
            await page.until(lambda: any(what == "MapView" for what, _, _ in page.calls[shown:]))
            assert "is being looked for" in page.one("message").text
        finally:
            answered.set()
        await refused
        assert "the nearest admissible pose is x " in page.one("message").text
        assert page.one("headline").content == figures

    on_page(steps, "tripteron")


def test_a_pose_that_takes_its_time_says_so(monkeypatch):
    seen = Event()

    def patient(request):
        seen.wait(RESCUE)
        return answers.picture(request)

    def wait(panel, said=ScenePanel.wait):
        said(panel)
        assert panel.message.text.endswith("...")
        seen.set()

    monkeypatch.setattr(lanes, "SECONDS_BEFORE_BUSY", 0.0)
    monkeypatch.setattr(page_of_a_tab, "picture", patient)
    monkeypatch.setattr(ScenePanel, "wait", wait)

    async def steps(page):
        assert seen.is_set()
        assert "..." not in page.one("message").text

    on_page(steps)


def test_an_impossible_pose_says_why_and_keeps_the_last_picture():
    async def steps(page):
        drawn = page.shown("MachineView", "show")
        figures = page.one("headline").content
        await page.send("control pose.z", "write", "2 m")
        assert page.one("status").text == "out of reach"
        assert "at most 1360 mm" in page.one("message").text
        assert page.shown("MachineView", "show") is drawn
        assert page.one("headline").content == figures
        assert page.one("control pose.z")._props["text"] == "2000 mm"
        await page.send("undo", "click")
        assert page.one("status").text == "ok"

    on_page(steps)


def test_picture_and_sentence_agree_beyond_a_limit_and_out_of_reach():
    """Beyond a limit the machine can be drawn, and is; out of reach it cannot."""

    async def steps(page):
        await page.send("control pose.z", "write", "200 mm")
        assert page.one("status").text == "joint limit"
        height = page.shown("MachineView", "show")["solids"]
        assert "The picture shows this pose" in page.one("message").text
        assert page.shown("MachineView", "overlay") == []
        await page.send("control geometry.platform_radius", "write", "91 mm")
        assert page.shown("MachineView", "show")["solids"] != height

    on_page(steps, "hexapod")


def test_an_analysis_that_fails_is_said_and_the_next_answer_takes_its_place(monkeypatch):
    async def steps(page):
        original = answers.analyze

        def failing(machine):
            raise ZeroDivisionError("division by zero")

        monkeypatch.setattr(answers, "analyze", failing)
        figures = page.one("headline").content
        await page.send("control pose.x", "write", "2 cm")
        assert page.one("status").text == "no answer"
        assert "ZeroDivisionError: division by zero" in page.one("message").text
        assert "still show the last good pose" in page.one("message").text
        assert page.one("headline").content == figures
        monkeypatch.setattr(answers, "analyze", original)
        await page.send("control pose.x", "write", "1 cm")
        assert page.one("status").text == "ok"

    with pytest.raises(AssertionError, match="raise ZeroDivisionError"):  # it is logged as well
        on_page(steps)


def test_a_mistake_while_something_is_done_is_said(monkeypatch):
    async def steps(page):
        monkeypatch.setattr(page.one("scene-key"), "set_content", None)
        await page.send("control pose.x", "write", "2 cm")
        assert "TypeError" in page.one("message").text

    with pytest.raises(AssertionError, match="in _show_report"):
        on_page(steps)


def test_a_singular_pose_is_drawn_with_the_motion_it_leaves_free():
    async def steps(page):
        await page.send("control pose.yaw", "write", "90 deg")
        assert page.one("status").text == "singular"
        assert "rz -1 rad" in page.one("message").text
        drawn = page.shown("MachineView", "show")["solids"]
        assert {solid["material"] for solid in drawn if solid["name"].startswith("free twist")} == {"soft rotation"}

    on_page(steps, "hexapod", ["limits.longest_leg=20 cm", "limits.base_joint_angle=90 deg"])


def test_history_by_buttons():
    async def steps(page):
        assert not page.one("undo").enabled
        await page.send("control pose.x", "write", "2 cm")
        assert page.one("undo").enabled
        await page.send("undo", "click")
        assert page.one("control pose.x")._props["text"] == "0 mm"
        await page.send("redo", "click")
        assert page.one("control pose.x")._props["text"] == "20 mm"
        await page.send("restart_alt", "click")
        assert page.one("control pose.x")._props["text"] == "0 mm"

    on_page(steps)


def test_a_place_on_the_map_moves_the_machine():
    async def steps(page):
        await page.send("map", "pick", {"x": 30.0, "y": 700.0})
        await page.send("map", "settle")
        assert page.one("control pose.x")._props["text"] == "30 mm"
        assert page.one("control pose.z")._props["text"] == "700 mm"
        await page.send("undo", "click")
        assert page.one("control pose.z")._props["text"] == "680 mm"

    on_page(steps)


def test_the_map_shows_any_quantity_over_any_two_coordinates():
    async def steps(page):
        await page.choose("map-quantity", "stiffness_z")
        assert page.shown("MapView", "show")["unit"] == "N/m"
        await page.choose("map-across", "geometry.base_radius")
        shown = page.shown("MapView", "show")
        assert shown["x"]["label"] == "base radius (mm)"
        assert shown["here"][0] == pytest.approx(220.0)
        middle = shown["values"][20 * 41 + 20]
        assert middle == pytest.approx(analyze(load(MACHINE)).stiffness_diagonal[5])
        await page.choose("map-up", "geometry.base_radius")
        assert "two different axes" in page.one("map-time").text

    on_page(steps)


def test_a_map_opens_on_what_can_be_reached_and_follows_the_machine_out_of_it():
    async def steps(page):
        shown = page.shown("MapView", "show")
        inside = [value is not None for value in shown["values"]]
        assert sum(inside) > 0.4 * len(inside), "the range of the sliders is reached in 15 % of it"
        assert shown["x"]["low"] < shown["here"][0] < shown["x"]["high"] < 60.0
        await page.send("control pose.x", "write", "7 cm")
        assert page.shown("MapView", "show")["x"]["high"] > 70.0

    on_page(steps, "hexapod")


def test_contributions_are_grouped_by_kind_as_analyze_groups_them(capsys):
    async def steps(page):
        await page.choose("contributions-component", "z")
        shown = page.one("contributions-bars").content
        assert "ball bearing compliance ×6" in shown
        assert shown.index("ball bearing compliance ×6") < shown.index("leg 1 ball bearing compliance")

    on_page(steps, "hexapod-hardware")


def test_numbers_that_follow_from_others_have_no_slider():
    async def steps(page):
        assert page.one("control legs.leg.ball.point.0")._props["slides"]
        assert not page.one("control legs.leg.ball.axis.0")._props["slides"]

    on_page(steps, "hexapod-hardware")


def test_contributions_are_the_attribution():
    async def steps(page):
        await page.choose("contributions-component", "y")
        shares = {one.spring: one.compliance_share[4] for one in analyze(load(MACHINE)).attribution}
        assert f"{100 * shares['passive link 1']:.1f} %" in page.one("contributions-bars").content
        assert "leg 1 actuator" not in page.one("contributions-bars").content

    on_page(steps)


def test_a_click_goes_to_the_worst_pose_of_a_requirement():
    demand = '\n[requirements]\nstiff = { demand = "free_stiffness_z > 60 N/um", over = ["z=12 cm:14 cm:3"] }\n'

    async def steps(page):
        await page.upload("mine.toml", (bundled()["hexapod"] + demand).encode())
        await page.front("Requirements")
        assert page.one("requirements-headline").text == "The requirement is not met."
        await page.send("worst-stiff", "click")
        assert "120" in str(page.one("control pose.z")._props)

    on_page(steps)


def test_every_view_follows():
    async def steps(page):
        for tab, mark, words in (
            ("Indices", "indices", "condition number of W"),
            ("Sensitivity", "sensitivity-bars", "stiffness.actuator"),
            ("Loads", "under-load", "carries no load"),
        ):
            await page.front(tab)
            assert words in page.one(mark).content
        await page.send("control load.force.2", "write", "-500 N")
        assert "−500 N" in page.one("under-load").content
        assert page.one("exaggeration").visible
        names = [solid["name"] for solid in page.shown("MachineView", "overlay")]
        assert "load/force" in names
        assert "ghost/platform/plate" in names

    on_page(steps)


def test_the_deflected_shape_is_exaggerated_as_one_likes():
    async def steps(page):
        assert not page.one("exaggeration").visible
        await page.send("control load.force.2", "write", "-500 N")
        own = page.shown("MachineView", "overlay")
        assert page.one("exaggeration")._props["text"].endswith(" (auto)")
        await page.send("exaggeration", "write", "× 1")
        row = page.one("exaggeration")._props
        assert row["text"] == "1"
        assert page.shown("MachineView", "overlay") != own
        await page.send("exaggeration", "slide", row["position"] + 1)
        assert page.one("exaggeration")._props["text"] == "2"
        await page.send("exaggeration", "write", "much")
        assert '"much"; it must be a number' in page.one("exaggeration")._props["problem"]
        await page.again()
        assert page.one("exaggeration")._props["text"] == "2"
        await page.send("undo", "click")
        await page.send("redo", "click")
        assert page.one("exaggeration")._props["text"] == "2"
        await page.send("exaggeration", "write", "auto")
        assert page.shown("MachineView", "overlay") == own

    on_page(steps)


def test_sensitivity_of_another_index():
    async def steps(page):
        await page.front("Sensitivity")
        before = page.one("sensitivity-bars").content
        await page.choose("sensitivity-quantity", "stiffness_y")
        assert page.one("sensitivity-bars").content != before
        assert "stiffness.passive_links" in page.one("sensitivity-bars").content

    on_page(steps)


def test_stiffness_over_a_link():
    async def steps(page):
        await page.front("Links")
        await page.choose("link-block", "K, translation")
        shown = page.shown("CurveView", "show")
        assert [line["name"] for line in shown["lines"]] == ["x", "y", "z"]
        assert shown["here"] == 1000.0
        y = shown["lines"][1]["values"]
        nearest = min(range(len(y)), key=lambda i: abs(math.log(shown["x"][i] / 1000.0)))
        assert y[nearest] == pytest.approx(analyze(load(MACHINE)).stiffness_diagonal[4], rel=0.01)

    on_page(steps)


def test_layers_can_be_hidden_and_views_chosen():
    async def steps(page):
        await page.choose("layer-ellipsoids", False)
        assert page.one("machine")._props["hidden"] == ["ellipsoids"]
        await page.send("view-top", "click")
        assert page.shown("MachineView", "look") == "top"
        assert page.dark is None  # as the system has it
        await page.send("browser", "theme", True)
        assert page.dark

    on_page(steps)


def test_another_machine_replaces_all_controls():
    async def steps(page):
        await page.choose("machines", "planar-3rpr")
        assert page.one("status").text == "ok"
        assert page.one("control pose.angle")._props["text"].endswith("deg")
        assert len(page.one("contributions-component").options) == 3
        assert page.one("map-across").value.startswith("pose.")

    on_page(steps)
