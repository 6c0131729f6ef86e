"""The page of a machine in a real browser, opened from disk: its formulas, its looks, its address, its manners."""

import base64
import json
import re
import zlib

import numpy as np
import pytest
from browser import browser, needs_chromium

from kinetostat import analyze, export, load
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.equilibrium.state import state_of
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import ENTRIES
from kinetostat.machine.parameters import values, with_values
from kinetostat.studies.attribution import by_part
from kinetostat.views.live_page import viewer
from kinetostat.views.scene.anatomy import anatomy
from printed_machines import MACHINES, machine_of, poses_of, worst_difference

POSES = 1000
AGREED = 1e-12
LARGEST_PAGE = 500_000
"""Bytes of a page at most."""
LONGEST_ADDRESS = 8192
PROGRAMS = """rows => rows.map(row => {
    const out = new Float64Array(42);
    const status = opened.programs.answers(row, out);
    return [status, ...Array.from(out, x => Number.isFinite(x) ? x : String(x))];
})"""

PLACES = """() => {
    const { data, programs } = opened, first = data.actuators.length + 12;
    const out = new Float64Array(first + 3 * data.drawing.points);
    programs.places(data.inputs.map(({ home }) => home), out);
    return [data.drawing, Array.from(out.slice(first))];
}"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The pages of bundled machines, and of some with rigid and free springs, written once: paths by what they show."""
    folder = tmp_path_factory.mktemp("pages")
    return {label: export(machine_of(label), folder / f"{label.replace(',', '')}.html")[0] for label in MACHINES}


def test_a_page_is_small_and_asks_for_nothing(pages):
    for path in pages.values():
        text = path.read_text("utf-8")
        assert len(text.encode()) < LARGEST_PAGE
        assert not re.search(r"(src|href)=|url\(|fetch\(|import\(|XMLHttpRequest", text)


def test_the_file_in_a_page_is_the_machine(pages):
    text = pages["tripteron"].read_text("utf-8")
    data = json.loads(text.split('id="machine">')[1].split("</script>")[0])
    assert "tripteron" in data["data"]["file"].lower()
    assert data["data"]["fileName"] == "tripteron.toml"


def test_the_papers_machine_fits_into_an_address(tmp_path):
    for name in ("zhang-gosselin-4dof", "hexapod", "tripteron"):
        text = export(load(name), tmp_path / "machine.link")[0].read_text("ascii")
        assert re.fullmatch(r"viewer\.html#m=[\w-]+\n", text)
        assert len(text) <= LONGEST_ADDRESS, name


@pytest.fixture(scope="module")
def viewer_page(tmp_path_factory):
    path = tmp_path_factory.mktemp("viewer") / "viewer.html"
    path.write_text(viewer(), "utf-8")
    return path


def ready(watched, address):
    watched.tab.goto("about:blank")
    watched.tab.goto(address)
    watched.tab.wait_for_function("document.documentElement.dataset.check")
    assert watched.tab.evaluate("document.documentElement.dataset.check") == "ok"


@pytest.fixture(scope="module")
def opening():
    """The browser of this file: it takes longer to start than to open a page."""
    with browser() as opening:
        yield opening


@pytest.fixture
def new_tab(opening):
    """Opens tabs that know nothing of those of other tests; they are closed at the end."""
    opened = []
    yield lambda *size: opened.append(opening(*size)) or opened[-1]
    for watched in opened:
        watched.tab.close()


@needs_chromium
def test_an_address_gives_the_numbers_of_its_page(pages, viewer_page, tmp_path, new_tab):
    """Programs that are data give the very numbers of the printed ones, and the pose is in the address too."""
    watched = new_tab()
    for name in ("zhang-gosselin-4dof", "hexapod-hardware", "planar-3rrr"):
        machine = load(name)
        home = [float(value) for key, value in values(machine).items() if key.startswith("pose.")]
        rows = (np.array(home) + 0.05 * np.random.default_rng(2).uniform(-1, 1, (50, len(home)))).tolist()
        ready(watched, pages[name].as_uri())
        expected = watched.tab.evaluate(PROGRAMS, rows)
        link = export(machine, tmp_path / "machine.link")[0].read_text("ascii").strip()
        first = next(key for key in values(machine) if key.startswith("pose.")).removeprefix("pose.")
        ready(watched, f"{viewer_page.as_uri()}#{link.partition('#')[2]}&{first}=0.0123")
        assert watched.tab.evaluate(PROGRAMS, rows) == expected
        assert watched.tab.title() == machine.name
        assert watched.tab.evaluate("location.hash").endswith(f"&{first}=0.0123")
        watched.tab.wait_for_function("document.querySelector('.slider input[type=number]').value !== ''")
        assert float(watched.tab.get_by_role("spinbutton").first.input_value()) == pytest.approx(12.3)
        assert not watched.complaints
        assert watched.hosts <= {""}


def damaged(content):
    text = json.dumps(content, separators=(",", ":")).encode()
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
    return base64.urlsafe_b64encode(deflate.compress(text) + deflate.flush()).decode().rstrip("=")


def opened_content(link):
    text = link.split("#m=")[1].strip()
    return json.loads(zlib.decompress(base64.urlsafe_b64decode(text + "=" * (-len(text) % 4)), -15))


EVIL = "1);globalThis.evil=1;("


@pytest.fixture(scope="module")
def link_content(tmp_path_factory):
    path = export(load("delta"), tmp_path_factory.mktemp("link") / "machine.link")[0]
    return opened_content(path.read_text("ascii"))


@needs_chromium
@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda c: c["packed"]["answers"].update(code="#" + EVIL), "cannot be opened"),
        (lambda c: c["packed"]["answers"]["numbers"].__setitem__(0, EVIL), "a number is damaged"),
        (lambda c: c["packed"]["answers"].update(references="$" * 9), "a reference is damaged"),
        (lambda c: c["packed"]["answers"].update(code="c"), "an operation is damaged"),
        (lambda c: c["packed"]["answers"].update(code="#" * 500000), "too long"),
        (lambda c: c.update(format=2), "of another version"),
        (lambda c: c["data"].update(name="<img src=x onerror=globalThis.evil=1>" * 9), ""),
        (lambda c: c["data"]["actuators"][0].update(name="<img src=x onerror=globalThis.evil=1>"), ""),
        (lambda c: c["data"]["actuators"][0].update(si="<img src=x onerror=globalThis.evil=1>"), ""),
        (lambda c: c["data"]["inputs"][0].update(name="<img src=x onerror=globalThis.evil=1>"), ""),
    ],
)
def test_an_address_is_data_and_never_code(change, says, viewer_page, link_content, new_tab):
    content = json.loads(json.dumps(link_content))
    change(content)
    watched = new_tab()
    watched.tab.goto(f"{viewer_page.as_uri()}#m={damaged(content)}")
    watched.tab.wait_for_function("document.querySelector('#status').textContent")
    assert says in watched.text("#status")
    assert watched.tab.evaluate("globalThis.evil ?? 0") == 0
    assert watched.tab.locator("img").count() == 0


@needs_chromium
def test_a_viewer_without_a_machine_says_what_it_is_for(viewer_page, new_tab):
    watched = new_tab()
    watched.tab.goto(viewer_page.as_uri())
    watched.tab.wait_for_function("document.querySelector('#status').textContent")
    assert "the machine that its address describes" in watched.text("#status")
    assert not watched.tab.locator("main").is_visible(), "controls of no machine"
    watched.tab.goto("about:blank")
    watched.tab.goto(f"{viewer_page.as_uri()}#m=abc")
    watched.tab.wait_for_function("document.querySelector('#status').classList.contains('bad')")
    assert not watched.tab.locator("main").is_visible(), "controls of no machine"
    assert not watched.complaints


@needs_chromium
def test_the_pose_follows_an_actuator(pages, new_tab):
    machine = load("hexapod")
    wanted = with_values(machine, {"pose.x": 0.004, "pose.roll": 0.05})
    coordinates = [float(actuator.coordinate) for actuator in stand(wanted)]
    watched = new_tab()
    ready(watched, pages["hexapod"].as_uri())
    home = [float(value) for key, value in values(machine).items() if key.startswith("pose.")]
    found = watched.tab.evaluate(
        "([wanted, start]) => poseOf(wanted, start, opened.data, opened.programs)", [coordinates, home]
    )
    expected = [float(value) for key, value in values(wanted).items() if key.startswith("pose.")]
    assert found == pytest.approx(expected, abs=1e-13)
    field = watched.tab.get_by_role("spinbutton", name="leg 1 actuator, mm")
    field.fill("96")
    field.press("Enter")
    watched.tab.wait_for_function("location.hash.includes('x=')")
    assert float(field.input_value()) == pytest.approx(96.0)
    field.fill("500")
    field.press("Enter")
    watched.tab.wait_for_function("document.querySelector('#status').classList.contains('bad')")
    assert "No pose nearby" in watched.text("#status")
    assert not watched.complaints


@needs_chromium
def test_states_of_rest_frequencies_and_shares_are_those_of_python(tmp_path, new_tab):
    machine = load("hexapod", ["load.force=[20, -30, -100]", "tool.mass=2 kg"])
    names = ["frequency_1", "displacement_z", "displacement_rx"]
    page = export(machine, tmp_path / "page.html", outputs=names, inputs=["load.force.2"])[0]
    home = {key: float(value) for key, value in values(machine).items() if key.startswith("pose.")}
    home["load.force.2"] = -100.0
    spread = [0.01, 0.01, 0.01, 0.1, 0.1, 0.1, 80.0]
    rows = np.array([*home.values()]) + np.random.default_rng(3).uniform(-1, 1, (100, 7)) * spread
    table = PointTable(dict(zip(home, np.ascontiguousarray(rows.T), strict=True)))
    expected = evaluate(machine, table, names)
    analysis = analyze(machine)
    watched = new_tab()
    ready(watched, page.as_uri())
    found = watched.tab.evaluate(
        """rows => rows.map(row => {
            const { data, programs } = opened, free = new Float64Array(1), loaded = new Float64Array(8);
            const status = programs.quantities(row, free);
            programs.loaded(row, loaded, restOf(row, data.rest, programs));
            return [status, free[0], loaded[6], loaded[7]];
        })""",
        rows.tolist(),
    )
    shares = watched.tab.evaluate(
        """() => {
            const out = new Float64Array(6 * opened.data.parts.length), C = new Float64Array(42);
            const home = opened.data.inputs.map(({ home }) => home);
            opened.programs.shares(home, out); opened.programs.answers(home, C);
            return opened.data.parts.map((name, n) => [name, out[6 * n + 5] / C[20]]);
        }"""
    )
    assert not watched.complaints
    found = np.array(found)
    np.testing.assert_array_equal(found[:, 0], expected.status)
    np.testing.assert_allclose(found[:, 1], expected.values["frequency_1"], rtol=1e-9)
    for k, name in enumerate(names[1:], 2):
        np.testing.assert_allclose(found[:, k], expected.values[name], rtol=1e-9)
    parts = {part: sum(c.compliance_share[5] for c in rows) for part, rows in by_part(analysis.attribution).items()}
    assert {name: share for name, share in shares if share > 1e-9} == pytest.approx(
        {name: share for name, share in parts.items() if share > 1e-9}, rel=1e-10
    )


@needs_chromium
def test_what_drives_carry_at_rest_is_found_there_in_a_page(tmp_path, new_tab):
    """In a machine that is meant loaded: such pages had been written and did not open."""
    limits = ["limits.actuator_force=500 N", "limits.actuator_speed=1 m/s"]
    machine = load("hexapod", ["load.state=loaded", "load.force=[20, -30, -100]", "tool.mass=2 kg", *limits])
    names = ["actuator_force", "least_wrench_force", "least_acceleration", "singularity_margin", "least_twist_speed"]
    rows, table = poses_of(machine, 5, 0.01)
    page = export(machine, tmp_path / "pkm.html", outputs=names)[0]
    watched = new_tab()
    ready(watched, page.as_uri())
    found = watched.tab.evaluate(
        """rows => rows.map(row => {
            const { data, programs } = opened, free = new Float64Array(2), loaded = new Float64Array(9);
            programs.quantities(row, free, stateOf("quantities", row, data, programs));
            programs.loaded(row, loaded, stateOf("loaded", row, data, programs));
            return [...loaded.subarray(6), ...free];
        })""",
        rows.tolist(),
    )
    for column, name in zip(np.array(found).T, names, strict=True):
        np.testing.assert_allclose(column, evaluate(machine, table, [name]).values[name], rtol=1e-9, err_msg=name)
    assert not watched.complaints


@needs_chromium
def test_machines_whose_legs_close_loops_rest_in_a_page(tmp_path, new_tab):
    names = [f"displacement_{component}" for component in ("rx", "ry", "rz", "x", "y", "z")]
    for name in ("delta", "tripteron", "hexapod-rus"):
        machine = load(name, ["load.force=[5, -3, -40]"])
        page = export(machine, tmp_path / f"{name}.html")[0]
        assert page.stat().st_size < LARGEST_PAGE
        home = {key: float(value) for key, value in values(machine).items() if key.startswith("pose.")}
        rows = np.array([*home.values()]) + np.random.default_rng(4).uniform(-0.03, 0.03, (20, len(home)))
        table = PointTable(dict(zip(home, np.ascontiguousarray(rows.T), strict=True)))
        expected = np.stack([evaluate(machine, table, names).values[each] for each in names], axis=1)
        watched = new_tab()
        ready(watched, page.as_uri())
        found = watched.tab.evaluate(
            """rows => rows.map(row => {
                const loaded = new Float64Array(6);
                opened.programs.loaded(row, loaded, restOf(row, opened.data.rest, opened.programs));
                return Array.from(loaded);
            })""",
            rows.tolist(),
        )
        sizes = np.abs(expected).max(axis=0)
        assert np.isfinite(expected).all()
        assert (np.abs(np.array(found) - expected) / sizes).max() < 1e-10, name
        assert not watched.complaints


@needs_chromium
def test_modes_of_massive_legs_that_close_loops_are_found_in_a_page(tmp_path, new_tab):
    """By loops of the page: the Tripteron has more springs in its legs than the closing of these leaves free."""
    machine = load("tripteron", ["load.force=[5, -3, -40]", "tool.mass=2 kg"])
    names = ["frequency_1", "frequency_3", "loaded_frequency_1", "load_factor", "displacement_z"]
    page = export(machine, tmp_path / "pkm.html", outputs=names)[0]
    rows, table = poses_of(machine, 5, 0.03)
    expected = evaluate(machine, table, names)
    watched = new_tab()
    ready(watched, page.as_uri())
    found = watched.tab.evaluate(
        """rows => rows.map(row => {
            const { data, programs } = opened, free = new Float64Array(2), loaded = new Float64Array(9);
            programs.quantities(row, free, stateOf("quantities", row, data, programs));
            programs.loaded(row, loaded, stateOf("loaded", row, data, programs));
            return [...free, ...loaded.subarray(6)];
        })""",
        rows.tolist(),
    )
    for column, name in zip(np.array(found).T, names, strict=True):
        np.testing.assert_allclose(column, expected.values[name], rtol=1e-9)
    assert not watched.complaints


@needs_chromium
def test_formulas_of_every_machine_are_those_of_the_engine(pages, new_tab):
    """At random poses: statuses are equal, entries within a share of the diagonal in their row and column."""
    for name, path in pages.items():
        watched = new_tab()
        watched.tab.goto(path.as_uri())
        watched.tab.wait_for_function("document.documentElement.dataset.check")
        assert watched.tab.evaluate("document.documentElement.dataset.check") == "ok", name
        machine = machine_of(name)
        rows, points = poses_of(machine, POSES, 0.3, seed=1)
        found = watched.tab.evaluate(PROGRAMS, rows.tolist())
        codes = np.array([int(row[0]) for row in found])
        numbers = np.array([[float(number) for number in row[1:]] for row in found])
        expected = evaluate(machine, points, ENTRIES, repeated=True)
        assert np.array_equal(codes, expected.status), name
        ok = codes == Status.OK
        assert ok.sum() > 20, name
        entries = np.stack([expected.values[e] for e in ENTRIES], axis=1)
        assert worst_difference(numbers[ok], entries[ok]) < AGREED, name
        joins_what_the_scene_joins(machine, *watched.tab.evaluate(PLACES))
        assert not watched.complaints
        assert watched.hosts <= {""}
        watched.tab.close()


def joins_what_the_scene_joins(machine, drawing, points):
    """Links of the picture end where those of the scene do, at the pose of the file."""
    points = np.array(points).reshape(-1, 3)
    legs = [anatomy(leg) for leg in state_of(machine).configuration.legs]
    for leg, drawn in zip(legs, drawing["legs"], strict=True):
        for end, number in ((leg.foot, drawn["foot"]), (leg.head, drawn["head"])):
            assert points[number] == pytest.approx(end.components(), abs=1e-9), leg.leg
        for link, (kind, _, length, *pairs) in zip(leg.links, drawn["links"], strict=True):
            assert (kind, len(pairs)) == (link.kind, 2 if kind == "bars" else 1)
            for start, end in pairs:
                assert points[end] - points[start] == pytest.approx(link.span.components(), abs=1e-9), link.name
                assert length == pytest.approx(link.span.norm())


@needs_chromium
def test_a_page_follows_its_address_and_its_sliders(pages, new_tab):
    machine = load("hexapod")
    watched = new_tab()
    watched.tab.goto(f"{pages['hexapod'].as_uri()}#x=0.01&yaw=0.1")
    watched.tab.wait_for_function("document.querySelectorAll('#matrix td').length === 36")
    assert float(watched.tab.get_by_role("spinbutton").first.input_value()) == pytest.approx(10.0)
    table = PointTable({"pose.x": np.array([0.01]), "pose.yaw": np.array([0.1])})
    expected = evaluate(machine, table, ["stiffness_z"]).values["stiffness_z"][0]
    shown = watched.tab.locator("#matrix tr:last-child td:last-child").inner_text()
    assert float(shown) == pytest.approx(1e-6 * expected, rel=1e-3)
    length = watched.tab.get_by_role("spinbutton", name="leg 1 actuator, mm")
    before = length.input_value()
    watched.tab.get_by_role("slider", name="z, mm").focus()
    watched.tab.keyboard.press("ArrowRight")
    watched.tab.wait_for_function("location.hash.includes('z=')")
    assert length.input_value() != before
    watched.tab.get_by_role("button", name="As in the file").click()
    watched.tab.wait_for_function("location.hash === ''")
    watched.tab.get_by_role("button", name="Compliance C").click()
    assert "µm/N" in watched.text("#matrix-units")
    watched.tab.locator("#map").click(position={"x": 5, "y": 5})
    watched.tab.wait_for_function("document.querySelector('#status').classList.contains('bad')")
    assert not watched.complaints


@needs_chromium
@pytest.mark.parametrize("width", [390, 768, 870, 1280, 1920])
def test_nothing_sticks_out_at_any_width(pages, width, new_tab):
    watched = new_tab(width)
    parts = "[...document.querySelectorAll('.column > *')]"
    wide = f"{parts}.filter(one => one.offsetWidth > (one.parentElement.clientWidth || innerWidth))"
    for name in ("hexapod-hardware", "planar-3rrr", "delta", "cogiro"):
        watched.tab.goto(pages[name].as_uri())
        watched.tab.wait_for_function("document.documentElement.dataset.mapTime")
        assert watched.tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
        assert not watched.tab.evaluate(f"{wide}.map(one => one.className)"), f"{name}: one column covers the other"
    assert not watched.complaints


@needs_chromium
def test_a_name_in_a_file_is_never_markup(tmp_path, new_tab):
    evil = "<img src=x onerror=document.title=1>"
    machine = load("tripteron")
    page = export(machine, tmp_path / "page.html")[0]
    content = json.loads(page.read_text("utf-8").split('id="machine">')[1].split("</script>")[0])
    actuator = content["data"]["actuators"][0]["name"]
    page.write_text(
        page.read_text("utf-8").replace(json.dumps(actuator), json.dumps(evil).replace("<", "\\u003c"), 1), "utf-8"
    )
    watched = new_tab()
    watched.tab.goto(page.as_uri())
    watched.tab.wait_for_function("document.querySelectorAll('#actuators tr').length === 3")
    assert watched.text("#actuators td") == evil
    assert watched.tab.locator("#actuators img").count() == 0
    assert not watched.complaints
