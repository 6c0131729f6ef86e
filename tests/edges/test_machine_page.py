"""The page of a machine in a real browser, opened from disk: its formulas, its looks, its address, its manners."""

import json
import re

import numpy as np
import pytest
from browser import browser, needs_chromium

from kinetostat import export, load
from kinetostat.engine.batch import evaluate
from kinetostat.engine.kernel import closes_inside
from kinetostat.engine.points import PointTable
from kinetostat.exchange.machine_functions import ENTRIES
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import bundled
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError

POSES = 1000
AGREED = 1e-12
LARGEST_PAGE = 500_000
"""Bytes of a page at most."""
PROGRAMS = """rows => rows.map(row => {
    const out = new Float64Array(42);
    const status = programs.answers(row, out);
    return [status, ...Array.from(out, x => Number.isFinite(x) ? x : String(x))];
})"""


def printable():
    machines = {name: load(name) for name in bundled()}
    return [name for name, machine in machines.items() if machine.family.chains is None or closes_inside(machine)]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The pages of bundled machines, written once: paths by name."""
    folder = tmp_path_factory.mktemp("pages")
    return {name: export(load(name), folder / f"{name}.html")[0] for name in printable()}


def test_a_page_is_small_and_asks_for_nothing(pages):
    for path in pages.values():
        text = path.read_text("utf-8")
        assert len(text.encode()) < LARGEST_PAGE
        assert not re.search(r"(src|href)=|url\(|fetch\(|import\(|XMLHttpRequest", text)


def test_the_file_in_a_page_is_the_machine(pages):
    text = pages["tripteron"].read_text("utf-8")
    data = json.loads(text.split('id="machine">')[1].split("</script>")[0])
    assert "tripteron" in data["file"].lower()
    assert data["fileName"] == "tripteron.toml"


def test_states_of_rest_are_refused(tmp_path):
    machine = load("hexapod", ["load.force=[0, 0, -10]"])
    with pytest.raises(InputError, match="--to c"):
        export(machine, tmp_path / "page.html", outputs=["displacement_z"])


@needs_chromium
def test_formulas_of_every_machine_are_those_of_the_engine(pages):
    """At random poses: statuses are equal, entries within a share of the diagonal in their row and column."""
    with browser() as new_tab:
        for name, path in pages.items():
            watched = new_tab()
            watched.tab.goto(path.as_uri())
            watched.tab.wait_for_function("document.documentElement.dataset.check")
            assert watched.tab.evaluate("document.documentElement.dataset.check") == "ok", name
            machine = load(name)
            home = {key: float(value) for key, value in values(machine).items() if key.startswith("pose.")}
            length = float(machine.chains().length if machine.family.chains else machine.configure().length)
            drawn = 0.3 * np.random.default_rng(1).uniform(-1.0, 1.0, (POSES, len(home)))
            rows = np.array([*home.values()]) + drawn * [length if key[-1] in "xyz" else 1.0 for key in home]
            found = watched.tab.evaluate(PROGRAMS, rows.tolist())
            codes = np.array([int(row[0]) for row in found])
            numbers = np.array([[float(number) for number in row[1:]] for row in found])
            table = PointTable(dict(zip(home, np.ascontiguousarray(rows.T), strict=True)))
            expected = evaluate(machine, table, ENTRIES, repeated=True)
            assert np.array_equal(codes, expected.status), name
            ok = codes == Status.OK
            assert ok.sum() > 20, name
            assert worst(numbers[ok], np.stack([expected.values[e] for e in ENTRIES], axis=1)[ok]) < AGREED, name
            assert not watched.complaints
            assert watched.hosts <= {""}
            watched.tab.close()


def worst(found, expected):
    """The largest difference of entries, as a share of the root of the diagonal entries in their row and column."""
    result, pairs = 0.0, [(i, j) for i in range(6) for j in range(i, 6)]
    for first in (0, 21):
        diagonal = {i: np.abs(expected[:, first + pairs.index((i, i))]) for i in range(6)}
        for k, (i, j) in enumerate(pairs, first):
            finite = np.isfinite(expected[:, k])
            assert np.array_equal(found[~finite, k], expected[~finite, k], equal_nan=True)
            scale = np.sqrt(diagonal[i] * diagonal[j])[finite]
            scale = np.where(np.isfinite(scale) & (scale > 0.0), scale, np.abs(expected[finite, k]).clip(1e-300))
            result = max(result, float((np.abs(found[finite, k] - expected[finite, k]) / scale).max(initial=0.0)))
    return result


@needs_chromium
def test_a_page_follows_its_address_and_its_sliders(pages):
    machine = load("hexapod")
    with browser() as new_tab:
        watched = new_tab()
        watched.tab.goto(f"{pages['hexapod'].as_uri()}#x=0.01&yaw=0.1")
        watched.tab.wait_for_function("document.querySelectorAll('#matrix td').length === 36")
        assert float(watched.tab.get_by_role("spinbutton").first.input_value()) == pytest.approx(10.0)
        table = PointTable({"pose.x": np.array([0.01]), "pose.yaw": np.array([0.1])})
        expected = evaluate(machine, table, ["stiffness_z"]).values["stiffness_z"][0]
        shown = watched.tab.locator("#matrix tr:last-child td:last-child").inner_text()
        assert float(shown) == pytest.approx(1e-6 * expected, rel=1e-3)
        before = watched.text("#actuators")
        watched.tab.get_by_role("slider", name="z, mm").focus()
        watched.tab.keyboard.press("ArrowRight")
        watched.until_changed("#actuators", before)
        watched.tab.wait_for_function("location.hash.includes('z=')")
        watched.tab.get_by_role("button", name="As in the file").click()
        watched.tab.wait_for_function("location.hash === ''")
        watched.tab.get_by_role("button", name="Compliance C").click()
        assert "µm/N" in watched.text("#matrix-units")
        watched.tab.locator("#map").click(position={"x": 5, "y": 5})
        watched.tab.wait_for_function("document.querySelector('#status').classList.contains('bad')")
        assert not watched.complaints


@needs_chromium
@pytest.mark.parametrize("width", [390, 768, 1280, 1920])
def test_nothing_sticks_out_at_any_width(pages, width):
    with browser() as new_tab:
        watched = new_tab(width)
        for name in ("hexapod-hardware", "planar-3rrr", "delta"):
            watched.tab.goto(pages[name].as_uri())
            watched.tab.wait_for_function("document.documentElement.dataset.mapTime")
            assert watched.tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
        assert not watched.complaints


@needs_chromium
def test_a_name_in_a_file_is_never_markup(tmp_path):
    evil = "<img src=x onerror=document.title=1>"
    machine = load("tripteron")
    page = export(machine, tmp_path / "page.html")[0]
    actuator = json.loads(page.read_text("utf-8").split('id="machine">')[1].split("</script>")[0])["actuators"][0][
        "name"
    ]
    page.write_text(
        page.read_text("utf-8").replace(json.dumps(actuator), json.dumps(evil).replace("<", "\\u003c"), 1), "utf-8"
    )
    with browser() as new_tab:
        watched = new_tab()
        watched.tab.goto(page.as_uri())
        watched.tab.wait_for_function("document.querySelectorAll('#actuators tr').length === 3")
        assert watched.text("#actuators td") == evil
        assert watched.tab.locator("#actuators img").count() == 0
        assert not watched.complaints
