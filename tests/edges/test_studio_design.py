"""Every control of the design tab, driven without a browser: a study is made, run, stopped, loaded, kept, compared."""

import asyncio
import json

import pytest
from studio_page import on_page

from kinetostat.cli import main
from kinetostat.commands.common import DONE
from kinetostat.machine.loading import as_toml, load
from kinetostat.spec.document import parse
from kinetostat.spec.study import read_study, study_toml
from kinetostat.studies.bundled import bundled_studies
from kinetostat.studio.design.state_folder import Favourites
from studies import SMALL

MACHINE = "zhang-gosselin-4dof"


async def design(page):
    await page.choose("mode", "Design")


async def small_study(page, generations="4"):
    """Two variables, few designs."""
    await design(page)
    for path in ("geometry.base_radius", "geometry.platform_radius"):
        await page.choose("study-add-variable", path)
    await page.choose("study-population", "8")
    await page.choose("study-generations", generations)


async def until(page, word, folder):
    """Until the search in front says so."""
    await page.watching(lambda: page.one("run-line").text.startswith(word), folder)


def test_a_study_made_in_the_form_is_what_the_command_solves(tmp_path, capsys):
    saved = []

    async def steps(page):
        await small_study(page)
        assert page.one("variable 0 from").value == "176 mm"
        await page.choose("variable 0 to", "25 cm")
        download = asyncio.ensure_future(page.user.download.next())
        await page.send("study-save", "click")
        saved.append((await download).text)
        await page.send("study-start", "click")
        assert page.one("study-problem").text == ""
        await until(page, "done", tmp_path)
        shown = page.shown("CurveView", "show")
        assert [line["name"] for line in shown["lines"]] == ["best", "mean"]
        saved.append(shown["lines"][0]["values"])
        result = page.one("run-result").content
        assert "geometry.base_radius" in result
        assert "times that of the initial design" in result
        await page.send("run-load", "click")
        saved.append(page.one("control geometry.base_radius")._props["text"])
        await page.send("undo", "click")
        assert page.one("control geometry.base_radius")._props["text"] == "220 mm"

    on_page(steps, state=tmp_path)
    file = tmp_path / "study.toml"
    file.write_text(saved[0])
    assert main(["optimize", str(file), "--json"]) == DONE
    told = json.loads(capsys.readouterr().out)
    assert told["convergence"]["best"] == saved[1]
    assert saved[2] == f"{1e3 * told['variables']['geometry.base_radius']:.6g} mm"


def test_a_front_is_shown_and_a_click_loads_a_design(tmp_path):
    async def steps(page):
        await small_study(page)
        await page.send("study-add-objective", "click")
        assert page.one("study-method").options == ["nsga2"]
        await page.choose("objective 0 quantity", "compliance_about")
        await page.choose("objective 0 direction", "0, 1, 0")
        await page.send("study-start", "click")
        assert page.one("study-problem").text == ""
        await until(page, "done", tmp_path)
        shown = page.shown("FrontView", "show")
        assert len(shown["points"]) > 1
        assert shown["initial"] is not None
        await page.send("run-front", "pick", 0)
        assert page.shown("FrontView", "show")["chosen"] == 0
        assert page.one("undo").enabled
        machine = page.one("control geometry.base_radius")._props["text"]
        await page.send("run-load", "click")
        assert page.shown("FrontView", "show")["chosen"] == shown["knee"]
        await page.send("undo", "click")
        assert page.one("control geometry.base_radius")._props["text"] == machine

    on_page(steps, state=tmp_path)


def test_a_front_of_three_objectives_is_seen_along_any_of_them(tmp_path):
    async def steps(page):
        await small_study(page)
        for _ in range(2):
            await page.send("study-add-objective", "click")
        await page.choose("objective 2 quantity", "stiffness_x")
        await page.send("study-start", "click")
        assert page.one("study-problem").text == ""
        await until(page, "done", tmp_path)
        shown = page.shown("FrontView", "show")
        assert (shown["axes"], shown["coloured"]) == ([0, 1], 2)
        assert shown["labels"] == ["compliance sum (SI)", "compliance z (m/N)", "stiffness x (N/m)"]
        assert all(len(point) == 3 for point in [*shown["points"], shown["initial"]])
        await page.choose("front-across", 2)
        await page.choose("front-colour", -1)
        shown = page.shown("FrontView", "show")
        assert (shown["axes"], shown["coloured"]) == ([2, 1], None)
        table = page.one("front-table")._props
        assert table["names"][2:4] == ["maximise stiffness x (N/m)", "base radius"]
        assert [row[:3] for row in table["values"]] == shown["points"]
        await page.send("front-table", "pick", 1)
        assert page.one("front-table")._props["chosen"] == page.shown("FrontView", "show")["chosen"] == 1
        assert page.one("control geometry.base_radius")._props["text"] == table["texts"][1][3]

    on_page(steps, state=tmp_path)


def test_stopped_reloaded_resumed_and_deleted(tmp_path):
    async def steps(page):
        await small_study(page, "100000")
        await page.send("study-start", "click")
        await page.watching(lambda: page.one("run-load").enabled, tmp_path)
        assert page.one("run-stop").enabled
        await page.again()
        await design(page)
        assert page.one("run-line").text.startswith("running")
        await page.send("run-stop", "click")
        await until(page, "stopped", tmp_path)
        assert "times that of the initial design" in page.one("run-result").content
        await page.send("run-play_arrow", "click")
        await until(page, "running", tmp_path)
        await page.send("run-stop", "click")
        await until(page, "stopped", tmp_path)
        await page.send("run-delete", "click")
        await page.send("confirm-yes", "click")
        assert page.one("run-choice").options == {}
        assert not page.one("run-load").enabled, "there is no best design yet"

    on_page(steps, state=tmp_path)


@pytest.mark.parametrize("name", bundled_studies())
def test_bundled_studies_fill_the_form(name):
    async def steps(page):
        await design(page)
        await page.choose("study-source", name)
        assert page.one("objective 0 quantity").value
        download = asyncio.ensure_future(page.user.download.next())
        await page.send("study-save", "click")
        study = read_study(parse((await download).text, name), name)
        kept = read_study(parse(bundled_studies()[name], name), name)
        assert study.model_copy(update={"changes": {}}) == kept.model_copy(update={"changes": {}})

    on_page(steps)


def test_constraints_and_poses_are_written_and_kept_as_in_a_file():
    """What the form writes is what a file says; what a file says is shown, and can be changed or taken out."""

    async def saved(page):
        download = asyncio.ensure_future(page.user.download.next())
        await page.send("study-save", "click")
        return read_study(parse((await download).text, "the form"), "the form")

    async def steps(page):
        await small_study(page)
        await page.send("study-add-constraint", "click")
        await page.choose("constraint 0 quantity", "compliance_z")
        await page.choose("constraint 0 side", "at_most")
        await page.choose("constraint 0 bound", "0.5 um/N")
        await page.choose("study-poses", "x=-1 cm:1 cm:3, z=67 cm:69 cm:2")
        study = await saved(page)
        assert [c.model_dump(exclude_none=True, exclude_defaults=True) for c in study.constraints] == [
            {"quantity": "compliance_z", "at_most": "0.5 um/N"}
        ]
        assert study.poses.over == ["x=-1 cm:1 cm:3", "z=67 cm:69 cm:2"]
        await page.choose("study-within", True)
        assert (await saved(page)).poses.within == "workspace"
        await page.choose("study-within", False)
        study = await saved(page)
        assert study.poses.within is None
        await page.upload("sent.toml", study_toml(study).encode(), "study-upload")
        assert page.one("constraint 0 side").value == "at_most"
        assert page.one("constraint 0 bound").value == "0.5 um/N"
        assert page.one("study-poses").value == "x=-1 cm:1 cm:3, z=67 cm:69 cm:2"
        await page.choose("constraint 0 bound", "0.5 s")
        await page.send("study-start", "click")
        assert "constraints.0.at_most" in page.one("study-problem").text
        await page.send("constraint 0 remove", "click")
        await page.choose("study-poses", "")
        study = await saved(page)
        assert (study.constraints, study.poses.over) == ([], None)
        listed = study_toml(study) + '\n[[poses.list]]\nx = "1 mm"\n\n[[poses.list]]\nx = "2 mm"\n'
        await page.upload("listed.toml", listed.encode(), "study-upload")
        assert page.one("study-listed").text.startswith("The study lists 2 poses one by one")
        assert len((await saved(page)).poses.listed) == 2

    on_page(steps)


def test_variables_and_objectives_can_be_taken_out():
    async def steps(page):
        await small_study(page)
        await page.send("variable 0 remove", "click")
        assert page.one("variable 0 from").value == "96 mm"
        await page.send("study-add-objective", "click")
        await page.send("objective 0 remove", "click")
        assert page.one("objective 0 quantity").value == "compliance_z"
        assert page.one("study-method").value == "genetic"
        await page.choose("objective 0 goal", "maximize")
        await page.choose("study-method", "hybrid")
        await page.choose("study-seed", "x")
        await page.send("study-start", "click")
        assert "optimizer.seed" in page.one("study-problem").text
        assert page.one("run-choice").options == {}
        assert not page.one("run-load").enabled, "there is no best design yet"

    on_page(steps)


def test_a_study_file_is_taken_or_refused():
    async def steps(page):
        await design(page)
        await page.upload("bad.toml", b"name = ", "study-upload")
        assert "not valid TOML" in page.one("study-problem").text
        await page.upload("small.toml", SMALL.encode(), "study-upload")
        assert page.one("study-problem").text == ""
        assert page.one("variable 1 to").value == "26 cm"
        assert page.one("study-source").value == "sent"

    on_page(steps)


@pytest.mark.parametrize("written", ['path = "platform_radius"', 'paths = ["geometry.platform_radius", "base_radius"]'])
def test_a_number_that_a_study_file_varies_is_not_offered_a_second_time(written):
    varied = SMALL.replace('path = "platform_radius"', written)
    if "paths" in written:
        varied = varied.replace('path = "base_radius"', 'path = "passive_leg_offset"')

    async def steps(page):
        await design(page)
        assert "geometry.platform_radius" in page.one("study-add-variable").options
        await page.upload("varied.toml", varied.encode(), "study-upload")
        assert page.one("study-problem").text == ""
        assert not page.one("study-add-variable").options.keys() & {"geometry.platform_radius", "geometry.base_radius"}

    on_page(steps)


def test_favourites_are_kept_loaded_compared_and_deleted(tmp_path):
    async def steps(page):
        await design(page)
        await page.send("control geometry.base_radius", "write", "25 cm")
        await page.choose("favourite-name", "wide <b>")
        await page.choose("favourite-note", "a note")
        await page.send("favourite-keep", "click")
        assert not page.one("favourite-compare").enabled
        await page.send("undo", "click")
        for number in (0, 1):
            await page.choose(f"favourite {number} tick", True)
        await page.send("favourite-compare", "click")
        shown = page.one("comparison").content
        assert "wide &lt;b&gt;" in shown
        assert "geometry.base_radius" in shown
        assert "<figure>" in shown
        await page.send("comparison-close", "click")
        await page.choose("favourite-quantities", "singularity_margin, least_translational_stiffness")
        await page.choose("favourite-over", "x=-1 cm:1 cm:3")
        await page.send("favourite-compare", "click")
        assert "Over x=-1 cm:1 cm:3" in page.one("comparison").content
        assert "least translational stiffness worst" in page.one("comparison").content
        await page.send("comparison-close", "click")
        await page.choose("favourite-over", "nonsense")
        await page.send("favourite-compare", "click")
        assert any("nonsense" in message for message in page.user.notify.messages)
        await page.choose("favourite-over", "")
        await page.send("favourite 1 load", "click")
        assert page.one("control geometry.base_radius")._props["text"] == "250 mm"
        assert page.one("undo").enabled
        await page.again()
        await design(page)
        await page.send("favourite 1 delete", "click")
        await page.send("confirm-no", "click")
        assert len(Favourites(tmp_path).entries()) == 1
        await page.send("favourite 1 delete", "click")
        await page.send("confirm-yes", "click")
        assert not Favourites(tmp_path).entries()

    on_page(steps, state=tmp_path)


def test_a_favourite_of_another_kind_opens_as_another_machine(tmp_path):
    Favourites(tmp_path).keep(load("hexapod"), "six legs")

    async def steps(page):
        await design(page)
        await page.send("favourite 1 load", "click")
        assert page.one("machines").value == "own"
        assert page.one("status").text == "ok"
        assert page.one("study-about").text == "Machine: six legs"

    on_page(steps, state=tmp_path)


def test_a_broken_favourite_is_refused(tmp_path):
    one = Favourites(tmp_path).keep(load(MACHINE), "mine")
    one.path.write_text(as_toml(load(MACHINE)).replace("0.22 m", "-1 m"))

    async def steps(page):
        await design(page)
        await page.send("favourite 1 load", "click")
        assert any("base_radius" in message for message in page.user.notify.messages)

    on_page(steps, state=tmp_path)
