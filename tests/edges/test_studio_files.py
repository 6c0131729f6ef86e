"""What goes into the studio and out of it: the text of a machine, files, links, tabs and what a server refuses."""

import asyncio
import gc
import io
import re
import weakref
import zipfile
from pathlib import Path

import httpx
import pytest
from nicegui import background_tasks, ui
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse
from studio_page import on_page

from kinetostat import export
from kinetostat.commands.common import LOCAL_HOSTS
from kinetostat.machine.loading import build, bundled, load
from kinetostat.studio.menus import first_sentence
from kinetostat.studio.serving import BoundedBody
from kinetostat.studio.text_pane import explanation_of, reading

MACHINE = "zhang-gosselin-4dof"


def test_the_text_of_the_machine_is_read_while_it_is_typed():
    async def steps(page):
        await page.choose("mode", "Text")
        text = page.one("text")._props["text"]
        assert "base_radius" in text
        wrong = text.replace("base_radius", "base_radios", 1)
        await page.send("text", "edit", wrong)
        assert "did you mean base_radius?" in page.one("text-message").content
        line = page.one("text")._props["line"]
        assert wrong.splitlines()[line - 1].startswith("base_radios")
        assert page.one("status").text == "ok"
        await page.send("control pose.x", "write", "1 cm")  # the mistake stays to be mended
        assert page.one("text")._props["text"] == text
        await page.send("text-back", "click")
        assert page.one("text")._props["line"] == 0
        text = page.one("text")._props["text"]
        assert build(text).tables["pose"].x == 0.01
        version = page.one("text")._props["version"]
        for height in ("690 mm", "695 mm"):
            await page.send("text", "edit", re.sub(r'(?m)^z( *)= ".*?"', f'z\\1= "{height}"', text))
        assert page.one("text")._props["version"] == version  # what is typed is not written over
        assert page.one("control pose.z")._props["text"] == "695 mm"
        assert page.shown("MachineView", "show")
        await page.send("undo", "click")
        assert page.one("control pose.z")._props["text"] == "680 mm"
        assert build(page.one("text")._props["text"]).tables["pose"].z == 0.68

    on_page(steps)


def test_the_text_of_another_kind_of_machine_replaces_all_controls():
    async def steps(page):
        await page.choose("mode", "Text")
        await page.send("text", "edit", bundled()["tripteron"])
        assert page.one("machines").value == "own"
        assert page.one("status").text == "ok"
        assert page.one("control pose.y")
        await page.send("text", "place", 1)
        assert "shows this text" in page.one("text-message").content

    on_page(steps)


@pytest.mark.parametrize(
    ("machine", "before", "after", "line"),
    [
        ("hexapod", "[geometry]", "[geometry", "[geometry"),
        ("hexapod", '"115 mm"', '"115 parsnips"', "base_radius "),
        ("hexapod", '"110 deg"', '"x"', "base_angles"),
        ("tripteron", "stiffness", "stiffnes", "name"),
    ],
)
def test_a_mistake_in_the_text_is_marked_at_its_line(machine, before, after, line):
    text = bundled()[machine].replace(before, after, 1)
    result = reading(text)
    assert result.machine is None
    assert text.splitlines()[result.line - 1].strip().startswith(line)


def test_the_meaning_of_a_field_is_that_of_the_schema():
    machine = load("hexapod")
    assert explanation_of(machine, "geometry.base_radius").startswith("<b>base_radius</b>: radius of the base joints")
    assert explanation_of(machine, "geometry.nothing") == explanation_of(machine, "name") == ""


def test_the_gallery_opens_any_bundled_machine():
    async def steps(page):
        await page.send("gallery", "click")
        for name in bundled():
            assert page.one(f"gallery {name}")
        await page.send("gallery delta", "click")
        assert page.one("machines").value == "delta"
        assert page.one("status").text == "ok"

    on_page(steps)


def test_a_machine_file_is_described_by_its_first_sentence():
    assert first_sentence(bundled()["passive-leg-3dof-pu"]).endswith("on the base axis: three freedoms")
    assert first_sentence(bundled()[MACHINE]).startswith("The machine of D. Zhang and C. M. Gosselin,")
    assert first_sentence('name = "mine"') == ""


def test_a_file_of_ones_own_opens_and_saves():
    async def steps(page):
        assert page.one("upload")._props["max-file-size"] == 1 << 20
        await page.upload("mine.toml", bundled()["hexapod"].replace("6-UPS hexapod", "Mine").encode())
        assert page.one("machines").value == "own"
        assert page.one("status").text == "ok"
        await page.send("control pose.x", "write", "1 mm")
        saved = asyncio.ensure_future(page.user.download.next())
        await page.send("save", "click")
        assert 'family = "hexapod"' in (await saved).text
        assert re.search(r'^x +?= "1 mm"', saved.result().text, re.MULTILINE)

    on_page(steps)


def test_the_machine_as_it_stands_is_written_for_other_programs(tmp_path):
    async def steps(page):
        await page.choose("machines", "delta")
        await page.send("control pose.x", "write", "5 mm")
        sent = {}
        for name in ("csv", "urdf"):
            download = asyncio.ensure_future(page.user.download.next(timeout=300.0))
            await page.send(f"file-{name}", "click")
            sent[name] = await download
        export(load("delta", ["pose.x=5 mm"]), tmp_path / "ours.csv")
        assert sent["csv"].text == (tmp_path / "ours.csv").read_text("utf-8")
        with zipfile.ZipFile(io.BytesIO(sent["urdf"].content)) as archive:
            assert {Path(held).suffix for held in archive.namelist()} == {".urdf", ".yaml"}
        await page.send("control pose.z", "write", "-30 m")
        await page.send("file-report, page", "click")
        assert any("would have to span" in message for message in page.user.notify.messages)

    on_page(steps)


def test_a_bad_file_is_refused_and_nothing_changes():
    async def steps(page):
        await page.upload("bad.toml", b"name = ")
        assert any("not valid TOML" in message for message in page.user.notify.messages)
        assert page.one("machines").value == MACHINE

    on_page(steps)


def test_names_from_files_are_never_markup():
    async def steps(page):
        text = bundled()["tripteron"].replace('name = "z"', 'name = "<img src=x>"').encode()
        await page.upload("mine.toml", text)
        assert page.one("machines").value == "own"
        await page.choose("contributions-component", "z")
        assert "&lt;img" in page.one("contributions-bars").content
        assert "<img" not in page.one("contributions-bars").content

    on_page(steps)


def test_two_tabs_do_not_disturb_each_other():
    async def steps(page):
        other = await page.another()
        await page.send("control pose.x", "write", "2 cm")
        assert other.one("control pose.x")._props["text"] == "0 mm"

    on_page(steps)


def test_a_tab_that_is_loaded_again_goes_on_where_it_was():
    async def steps(page):
        await page.send("control pose.x", "write", "2 cm")
        await page.again()
        assert page.one("control pose.x")._props["text"] == "20 mm"
        assert page.one("undo").enabled

    on_page(steps)


def test_a_link_opens_the_same_machine_at_the_same_pose_in_another_tab():
    async def steps(page):
        await page.choose("machines", "hexapod")
        await page.send("control pose.x", "write", "1/3 mm")
        await page.send("control geometry.base_angles.1", "write", "12 deg")
        address = page.one("browser")._props["address"]
        assert address.startswith("machine=hexapod&geometry.base_angles.1=")
        other = await page.another(f"/?{address}")
        assert other.one("machines").value == "hexapod"
        assert other.one("browser")._props["address"] == address
        assert other.one("control pose.x")._props["text"] == page.one("control pose.x")._props["text"]
        assert not page.user.notify.messages

    on_page(steps)


def test_a_link_to_a_machine_of_ones_own_holds_its_file():
    async def steps(page):
        await page.upload("mine.toml", bundled()["tripteron"].replace('name = "z"', 'name = "up & down"').encode())
        await page.send("control load.force.2", "write", "-500 N")
        other = await page.another(f"/?{page.one('browser')._props['address']}")
        assert other.one("machines").value == "own"
        assert other.one("control load.force.2")._props["text"] == "-500 N"

    on_page(steps)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("machine=hexapo", "did you mean"),
        ("machine=hexapod&pose.x=5 parsnips", "parsnips"),
        ("machine=hexapod&pose.q=5 mm", "pose.q"),
        ("file=AAAA", "damaged or too large"),
        ("pose.x=5 mm", "names no machine"),
    ],
)
def test_a_link_with_a_mistake_is_refused_with_a_reason(address, message):
    async def steps(page):
        other = await page.another(f"/?{address}")
        assert any(message in text for text in other.user.notify.messages)
        assert other.one("machines").value == MACHINE

    on_page(steps)


def test_a_page_that_is_gone_computes_nothing_more():
    async def steps(page):
        count = len(page.calls)
        with page.user.client as client:
            page.one("control pose.x")
            client.delete()
        await page.settled()
        assert len(page.calls) == count

    on_page(steps)


def test_a_page_that_is_gone_is_not_kept_in_memory():
    async def steps(page):
        before = set(background_tasks.running_tasks)
        other = await page.another()
        client = other.user.client
        elements = [weakref.ref(element) for element in client.elements.values() if not isinstance(element, ui.upload)]
        with client:
            client.delete()
        del other, client
        while of_the_page := set(background_tasks.running_tasks) - before:
            await asyncio.wait(of_the_page)
        assert page.user.client  # the stand-ins of NiceGUI's functions are those of this tab again, and keep it
        gc.collect()
        assert len(elements) > 100
        assert not [kept for element in elements if (kept := element())]

    on_page(steps)


@pytest.mark.parametrize(("host", "code"), [("127.0.0.1", 200), ("evil.example", 400)])
def test_only_this_computer_is_answered(host, code):
    """Against a page of another site whose name is made to point to this computer."""
    served = TrustedHostMiddleware(PlainTextResponse("page"), allowed_hosts=list(LOCAL_HOSTS))
    assert asyncio.run(asked(served, headers={"Host": host})).status_code == code


@pytest.mark.parametrize("chunked", [False, True])
def test_a_request_that_is_too_large_is_cut_off(chunked):
    seen = []

    async def taking(scope, receive, send):
        request = Request(scope, receive)
        seen.append(len(await request.body()))
        await PlainTextResponse("taken")(scope, receive, send)

    async def parts():
        for _ in range(20):
            yield b"x" * 1000

    served = BoundedBody(taking, largest=10_000)
    content = parts() if chunked else b"x" * 20_000
    if chunked:
        with pytest.raises(ClientDisconnect):
            asyncio.run(asked(served, content=content))
    else:
        assert asyncio.run(asked(served, content=content)).status_code == 413
    assert not seen
    assert asyncio.run(asked(served, content=b"x" * 9000)).text == "taken"


async def asked(served, **what):
    async with httpx.AsyncClient(transport=httpx.ASGITransport(served), base_url="http://127.0.0.1") as client:
        return await client.post("/", **what)
