"""`kinetostat report`: a page holds what `analyze` says, asks for nothing, is the same again, and trusts no name."""

import io
import json
from contextlib import redirect_stdout

import pytest
from machine_files import GOOD
from pypdf import PdfReader
from report_pages import MACHINE, QUICK, Page, no_pictures, number, reported, small_pictures

from kinetostat import report
from kinetostat.cli import main
from kinetostat.commands import documents
from kinetostat.commands.common import STOPPED
from kinetostat.machine.loading import as_toml, bundled, load
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError
from kinetostat.spec.installation import extra_command
from kinetostat.studies import report as report_study
from kinetostat.studies.analysis import analyze
from kinetostat.studies.datasets import usual_ranges
from kinetostat.studies.report import REPORT_PARTS
from kinetostat.studies.requirements import requirements
from kinetostat.views.report import summary, writers
from kinetostat.views.report.writers import html_page
from kinetostat.views.report.writing import Origin, report_of
from pages import ROOT
from studies import SMALL

LOAD = ["--set", 'load.force=["0 N","0 N","-500 N"]']
HOSTILE = '<script>alert(1)</script> #import "x": $a$ [/red] *b* @c \\d'
ORIGIN = Origin("kinetostat report", (("machine.toml", "x = 1 < 2"),), "", "{}")
TINY = SMALL + "[optimizer]\npopulation = 12\ngenerations = 4\n"


@pytest.fixture(autouse=True)
def _blank(monkeypatch):
    no_pictures(monkeypatch)


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        small_pictures(patch)
        return Page(reported(tmp_path_factory.mktemp("report") / "r.html", MACHINE, *LOAD))


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """A PDF of a machine with a hostile name."""
    folder = tmp_path_factory.mktemp("report")
    file = folder / "mine.toml"
    file.write_text(GOOD.replace('"test machine"', json.dumps(HOSTILE)), "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        no_pictures(patch)
        return PdfReader(io.BytesIO(reported(folder / "r.pdf", file, *QUICK, "--author", HOSTILE)))


def told(*words):
    """What a command says as JSON."""
    said = io.StringIO()
    with redirect_stdout(said):
        assert main([*words, "--json"]) == 0
    return json.loads(said.getvalue())


def quick(machine):
    """The page about a machine, without what takes time."""
    found = report_study.gather(machine, without=REPORT_PARTS)
    return html_page(report_of(found, "Validation was left out.", ORIGIN, {}, True))


def test_its_matrices_are_those_of_analyze(paper):
    found = told("analyze", MACHINE, *LOAD)
    assert paper.results == found
    for start, key in (("Stiffness K", "stiffness"), ("Compliance C", "compliance")):
        heads, *rows = paper.table(start)
        assert heads[1:] == [row[0] for row in rows] == found["components"]
        for row, expected in zip(rows, found[key], strict=True):
            assert [number(cell) for cell in row[1:]] == pytest.approx(expected, rel=1e-3, abs=1e-12)


def test_its_loads_are_those_of_analyze(paper):
    load_case = paper.results["load"]
    _, loaded, deflected = paper.table("The load at the ")
    assert [number(cell) for cell in loaded[1:]] == pytest.approx(load_case["wrench"])
    assert [number(cell) for cell in deflected[1:]] == pytest.approx(load_case["deflection"], rel=1e-3)
    actuators = [spring for spring in load_case["springs"] if spring["actuated"]]
    rows = paper.table("Actuators under")[1:]
    assert [number(row[1].partition(" ")[0]) for row in rows] == pytest.approx(
        [one["load"] for one in actuators], rel=1e-3
    )


@pytest.mark.parametrize(
    ("settings", "point", "other"),
    [
        ([], "platform point P", "at the tool point"),
        (['tool.offset=["0 mm","0 mm","-80 mm"]'], "tool point T", "at the platform point"),
    ],
)
def test_the_reference_point_has_one_name(settings, point, other):
    page = Page(quick(load(MACHINE, [*settings, LOAD[1]])))
    assert f"Each direction at the {point}" in page.text
    assert f"The load at the {point}" in page.text
    assert f"mm from the {point}" in page.text
    assert f"points from the {point}" in page.text
    assert other not in page.text


def test_every_number_of_the_machine_has_its_unit(paper):
    sheet = {row[0]: row[1] for row in paper.table("All values")[1:]}
    assert sheet["geometry.base_radius"] == "220 mm"
    assert sheet["geometry.base_angle"] == "30°"
    assert sheet["stiffness.actuator"] == "4 × 1000 N/m"
    assert sheet["load.force"] == "0 N, 0 N, −500 N"


def test_every_question_has_a_section(paper):
    for title in ("Data sheet", "Attribution", "Load case", "Over the poses", "Guidelines", "Sensitivity", "Validation",
                  "Method", "Record"):  # fmt: skip
        assert title in paper.text
    assert "Exudyn" in paper.text
    assert "agrees" in paper.text
    assert "Over x (mm) from −50 to 50 and z (mm) from 630 to 730" in paper.text
    assert "weakest: doubling" in paper.text
    ranking = [row[0] for row in paper.table("Zhang & Gosselin 4-dof: compliance, percent per percent")[1:]]
    assert ranking[0] == "geometry.passive_links.0"


def test_parts_that_share_a_direction_are_named_by_their_kind_and_numbers_have_no_unit(tmp_path):
    """Each of eight winches has too small a share to be named alone; the exponent of a norm is no length per length."""
    with pytest.MonkeyPatch.context() as patch:
        no_pictures(patch)
        page = Page(reported(tmp_path / "r.html", "cogiro", *QUICK, "--without", "maps"))
    mainly = {row[0]: row[-1] for row in page.table("Each direction")[1:]}
    assert mainly["z"] == mainly["rz"] == "winch ×8 100\N{NO-BREAK SPACE}%"
    assert mainly["x"].startswith("cable 3 winch 31")
    assert {row[0]: row[1] for row in page.table("All values")[1:]}["cables.exponent"] == "2"


def test_it_can_be_made_again(paper, tmp_path):
    """The command, the file as written, and the machine with its overrides are in the page."""
    assert 'kinetostat report zhang-gosselin-4dof --set \'load.force=["0 N","0 N","-500 N"]\'' in paper.text
    assert "# Ka: one for all legs, or a list, one per leg" in paper.text
    again = tmp_path / "again.toml"
    again.write_text(json.loads(paper.attached["machine.toml"]), "utf-8")
    assert values(load(again)) == values(load(MACHINE, LOAD[1:]))


def test_a_page_asks_for_nothing(paper):
    assert {address.split(":")[0].split("#")[0] for address in paper.addresses} <= {"data", ""}
    assert not {"link rel=stylesheet", "object", "embed", "base"} & set(paper.tags)
    assert paper.tags.count("iframe") == 1, "the machine to move, which has no address"
    styles = "".join(text for name, text in paper.attached.items() if name == "?")
    assert "@import" not in styles
    assert "url(" not in styles


@pytest.mark.parametrize("suffix", ["html", "pdf"])
def test_the_same_input_gives_the_same_bytes(suffix, tmp_path):
    words = ["planar-3rrr", "--without", "validation", "--without", "guidelines"]
    first, second = (reported(tmp_path / folder / f"r.{suffix}", *words) for folder in "ab")
    assert first == second


def test_a_pdf_has_pages_with_numbers_and_carries_its_data(printed):
    text = "\n".join(page.extract_text() for page in printed.pages)
    count = len(printed.pages)
    assert 4 <= count <= 12
    assert f"{count} / {count}" in printed.pages[-1].extract_text()
    assert "0.07046" not in text, "the matrix, not the coefficients"
    assert "7.046" in text
    assert "−0.5" not in printed.metadata.title
    results = json.loads(printed.attachments["results.json"][0])
    assert results["stiffness_diagonal"][3] == pytest.approx(70.4587, rel=1e-6)
    assert printed.attachments["machine.toml"][0].decode() == GOOD.replace('"test machine"', json.dumps(HOSTILE))


def test_a_name_is_no_command_in_a_pdf(printed):
    assert printed.metadata.title == HOSTILE
    text = "".join(printed.pages[0].extract_text().replace("\u200b", "").split())
    assert text.count("".join(HOSTILE.split())) >= 3, "title, machine, author"


def test_a_name_is_no_command_on_a_page(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(GOOD.replace('"test machine"', json.dumps(HOSTILE)) + "# </pre><script>\n", "utf-8")
    page = Page(reported(tmp_path / "r.html", file, *QUICK, "--without", "maps", "--author", HOSTILE))
    assert page.text.count(HOSTILE) >= 3
    assert "# </pre><script>" in page.text
    assert page.results["name"] == HOSTILE
    ours = {"machine.toml", "results.json", "live-data", "?"}
    assert set(page.attached) == ours
    assert not any("alert(1)" in text for name, text in page.attached.items() if name in ("?", "live-data"))


def test_rigid_and_free_directions_say_so(tmp_path):
    rigid = Page(quick(load(MACHINE, ["stiffness.passive_links=rigid"])))
    assert "Some directions are rigid: K is infinite there" in rigid.text
    assert rigid.table("Stiffness K")[1][3] == "rigid"
    free = Page(quick(load(MACHINE, ["stiffness.actuator=[0, 1000, 1000, 1000]"])))
    assert "Some directions are free: C is infinite there" in free.text
    assert "free" in free.table("Compliance C")[1]


def test_what_a_file_lacks_is_said_in_a_sentence():
    page = Page(quick(load(MACHINE)))
    for sentence in ("The machine file has no load.", "Maps were left out.", "Guidelines were left out.",
                     "Sensitivities were left out.", "Validation was left out."):  # fmt: skip
        assert sentence in page.text


@pytest.mark.parametrize("name", bundled())
def test_every_bundled_machine_has_a_page(name):
    page = Page(quick(load(name)))
    assert page.results == {}
    assert page.table("Compliance C")
    assert {"svg", "img", "math"} <= set(page.tags)


def test_the_command_leaves_out_what_can_be_left_out():
    assert documents.REPORT_PARTS == REPORT_PARTS


@pytest.mark.parametrize("setting", ["pose.z=3 m", "limits.longest_leg=10 cm"])
def test_a_pose_without_answer_has_no_report(setting, tmp_path, capsys):
    assert main(["report", MACHINE, "--set", setting, "-o", str(tmp_path / "r.html")]) == 1
    assert analyze(load(MACHINE, [setting])).message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["-o", "r.docx"], "a report is .html or .pdf"),
        (["--over", "x=0:1:3", "--over", "z=0:1:3", "--over", "theta5=0:1:3"], "one coordinate or two, not 3"),
        (["--over", "height=0:1:3"], "is not a field"),
        (["--engine", "abacus"], "There is no engine"),
    ],
)
def test_bad_input_is_refused_with_its_reason(words, reason, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["report", MACHINE, *words]) == 2
    assert reason in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_without_typst_a_pdf_is_refused_at_once(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(writers, "find_spec", lambda _: None)
    assert main(["report", MACHINE, "-o", str(tmp_path / "r.pdf")]) == 2
    assert extra_command("report") in capsys.readouterr().err


def test_without_the_renderer_a_page_shows_the_picture_and_says_so(monkeypatch):
    for module in (summary, writers):
        monkeypatch.setattr(module, "renderer_modules", lambda: None)
    page = Page(quick(load(MACHINE)))
    assert "live-data" not in page.attached
    assert "img" in page.tags
    assert f"run this before you make the report: {extra_command('report')}" in page.text


def test_a_report_that_is_stopped_leaves_the_old_file(tmp_path, capsys, monkeypatch):
    def stop(*arguments):
        raise KeyboardInterrupt

    kept = tmp_path / "r.html"
    kept.write_text("old")
    monkeypatch.setattr(report_study, "sensitivity", stop)
    assert main(["report", MACHINE, "-o", str(kept)]) == STOPPED
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]
    assert kept.read_text() == "old"


def test_ranges_end_where_the_machine_can_follow():
    """As far as the limits in the file allow; every end has an answer, and ends are round."""
    spans = []
    for settings in ([], ["limits.longest_leg=1.4 m"]):
        ranges = usual_ranges(load("tricept", settings), 5)
        assert [text.split("=")[0] for text in ranges] == ["pose.length", "pose.theta1"]
        for text in ranges:
            path, _, ends = text.partition("=")
            low, high, count = ends.split(":")
            assert count == "5"
            for end in (low, high):
                assert analyze(load("tricept", [*settings, f"{path}={end}"])).status.word == "ok"
        spans.append(float(high) - float(low))
    assert spans[1] < spans[0]


def test_the_users_ranges_are_mapped(tmp_path):
    page = Page(reported(tmp_path / "r.html", MACHINE, "--over", "stiffness.passive_links=1e3:1e7:9:log", *QUICK))
    assert "from 1000 to 1×10⁷" in page.text
    least, greatest = (number(cell) for cell in page.table("Extremes")[3][1:3])
    assert (least, greatest) == pytest.approx((1.5e-7, 1.5e-3), rel=1e-3)


def test_a_study_is_reported_with_its_best_design(tmp_path):
    file, folder = tmp_path / "study.toml", tmp_path / "searched"
    file.write_text(TINY, "utf-8")
    found = told("optimize", str(file), "-o", str(folder))
    page = Page(reported(tmp_path / "r.html", file, *QUICK, "--without", "maps"))
    assert page.results["name"].endswith(", optimised")
    worth = page.table("Objectives: the original machine")[1]
    assert number(worth[2]) == pytest.approx(found["objective"], rel=1e-8)
    bounds = {row[0]: row[2:4] for row in page.table("Variables and their bounds")[1:]}
    assert bounds["geometry.base_radius"] == ["200 mm", "260 mm"]
    assert [row[0] for row in page.table("Variables of")[1:]] == list(found["variables"])
    stored = Page(reported(tmp_path / "s.html", folder, *QUICK, "--without", "maps"))
    assert stored.results == page.results
    assert stored.tables == page.tables


def test_a_study_without_feasible_design_has_no_report(tmp_path, capsys):
    file = tmp_path / "study.toml"
    file.write_text(TINY + '[[constraints]]\nquantity = "compliance_z"\nat_most = "1e-9 m/N"\n', "utf-8")
    assert main(["report", str(file), "-o", str(tmp_path / "r.html")]) == 1
    assert "No feasible design was found" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


LESS = [*QUICK, "--without", "maps"]


def test_a_machine_meant_under_load_has_a_section_of_it(tmp_path, capsys):
    words = [*LESS, "--set", "load.force=[0, 150, -400]"]
    page = Page(reported(tmp_path / "r.html", "hexapod", *words, "--loaded"))
    state = told("analyze", "hexapod", "--loaded", *words[-2:])
    assert page.results["under_load"] == state
    assert f"Under load, ok: {state['message']}" in page.text
    moved = page.table("Displacement of the tool point")
    assert [number(cell) for cell in moved[1][1:]] == pytest.approx([1e6 * u for u in state["displacement"]], rel=1e-3)
    springs = page.table("Loads and deformations of the springs")[1:]
    assert [number(row[1].split()[0]) for row in springs] == pytest.approx(
        [spring["load"] for spring in state["springs"]], rel=1e-3
    )
    demanded = {row[0]: row[1:] for row in page.table("The machine under its loads, and what its file demands")[1:]}
    assert demanded["displacement of the tool"][1] == "no requirement"
    assert demanded["greatest force of an actuator"][1].startswith("at most 500 N")
    heads, *rows = page.table("Stiffness that further loads meet")
    assert heads[1:] == ["1/C under load", "1/C free state", "K under load", "of springs", "K free state"]
    assert number(rows[5][3]) == pytest.approx(state["tangent_stiffness"][5][5] * 1e-6, rel=1e-3)
    said_by_file = reported(tmp_path / "s.html", "hexapod", *words, "--set", "load.state=loaded")
    assert Page(said_by_file).results == page.results
    assert "Under load, ok:" not in Page(reported(tmp_path / "t.html", "hexapod", *words)).text
    pdf = PdfReader(io.BytesIO(reported(tmp_path / "r.pdf", "hexapod", *words, "--loaded")))
    assert "Under load, ok:" in " ".join(" ".join(page.extract_text().split()) for page in pdf.pages)


def test_loads_without_rest_are_said_in_the_report(tmp_path):
    words = ["--set", "load.force=[0, 0, -2e9]", "--set", "limits.actuator_force=none", "--loaded"]
    page = Page(reported(tmp_path / "r.html", "hexapod", *LESS, *words))
    assert "Under load, no rest: 6-UPS hexapod (stewart-simscape) comes to no rest" in page.text
    assert not any(caption.startswith("Loads and deformations of") for caption in page.tables)


def test_a_machine_with_a_heavy_platform_has_a_section_of_its_vibrations(tmp_path):
    words = [*LESS, "--set", "tool.mass=12 kg", "--set", "tool.inertia=[0.3, 0.3, 0.5, 0, 0, 0]"]
    page = Page(reported(tmp_path / "r.html", "hexapod", *words))
    known = told("modes", "hexapod", *words[-4:])
    assert page.results["vibration"] == known
    assert f"Modes: {known['message']}".replace("\N{NO-BREAK SPACE}", " ") in page.text
    _, *rows = page.table("Modes")
    assert [number(row[1]) for row in rows] == pytest.approx([m["frequency"] for m in known["modes"]], rel=5e-4)
    assert "Modes:" not in Page(reported(tmp_path / "s.html", "hexapod", *LESS)).text


def test_a_machine_with_tolerances_has_a_section_of_its_error(tmp_path):
    words = [*LESS, "--set", "tolerances.joints=0.05 mm"]
    page = Page(reported(tmp_path / "r.html", "hexapod", *words))
    built = told("budget", "hexapod", *words[-2:])
    assert page.results["budget"] == built
    assert f"As built: {built['message']}" in page.text
    _, *rows = page.table("Error of the tool at the platform point P")
    assert number(rows[-1][4]) == pytest.approx(1e6 * built["errors"]["usual"]["position"], rel=5e-3)
    assert [row[0] for row in page.table("Contributions to the variance: lines")[1:]] == ["joints"]
    assert "As built:" not in Page(reported(tmp_path / "s.html", "hexapod", *LESS)).text


def test_a_fit_has_a_section_with_its_numbers_and_pictures(tmp_path):
    folder = tmp_path / "fit"
    folder.mkdir()
    unknown = {"path": "legs.leg 1.actuator.zero", "group": "zeros", "unit": "m", "words": "zero of leg 1"}
    record = {
        "machine": load("hexapod").name, "family": "hexapod", "data": "m.csv", "poses": 20, "values": 60, "rank": 1,
        "unknowns": [
            unknown | {"value": 1.234e-4, "half_interval_95": 2e-6},
            unknown | {"path": "legs.leg 2.actuator.compliance", "group": "compliances", "unit": "1", "value": 0.125,
                       "half_interval_95": None},
        ],
        "covariance": [[1e-12, 0.0], [0.0, 0.0]], "scatter": 3.2, "sigma_known": True,
        "before": {"length": 4e-4}, "after": {"length": 5e-6}, "left_out": {"length": 6e-6},
        "outliers": [{"line": 17, "value": "x", "sigmas": -35.0}],
        "unseen": [{"words": "A <common> shift.", "tool": 1e-3, "inside": 0.0}],
    }  # fmt: skip
    (folder / "fit.json").write_text(json.dumps(record))
    residual = next((ROOT / "docs" / "images").glob("*.png"))
    (folder / "residuals.png").write_bytes(residual.read_bytes())
    (folder / "poses.png").write_text("not a picture")
    page = Page(reported(tmp_path / "r.html", "hexapod", *LESS, "--fit", str(folder)))
    for words in ("60 values at 20 poses", "m.csv", "3.2 times as large", "123.4 2.0 µm", "12.5", "not seen", "400 µm",
                  "A <common> shift.", "17"):  # fmt: skip
        assert words in page.text
    assert "What is left of every measured value" in page.text
    assert "The tool points at which" not in page.text
    with pytest.raises(InputError, match="is the fit of 6-UPS hexapod"):
        report(load("delta"), tmp_path / "s.html", fit=folder)
    (folder / "fit.json").write_text('{"machine": 3}')
    with pytest.raises(InputError, match="is not the record of a fit"):
        report(load("hexapod"), tmp_path / "s.html", fit=folder)
    with pytest.raises(InputError, match="cannot be read"):
        report(load("hexapod"), tmp_path / "s.html", fit=tmp_path / "nowhere.json")


def test_the_motor_that_a_file_requires_stands_in_its_diagram(tmp_path):
    """The section shows that motor alone, and says of it what the verdict says."""
    file = tmp_path / "mine.toml"
    settings = ["tool.mass=12 kg", "drives.lead=10 mm", "load.gravity=[0, 0, -9.81]"]
    sines = "field, amplitude, frequency [Hz]\nx, 5 mm, 4\nz, 2 mm, 8\n"
    required = f'[requirements]\nservo.fits = "yaskawa-sgmp-03b"\nservo.motion = """\n{sines}"""\n'
    file.write_text(as_toml(load("hexapod", settings)) + required, "utf-8")
    page = Page(reported(tmp_path / "report.html", str(file), *LESS))
    motor, fits, *shares, _ratio, _drive = page.table("Share of its limits")[1]
    (verdict,) = requirements(load(file))
    assert (motor, fits) == ("yaskawa-sgmp-03b", "yes")
    assert max(number(share.removesuffix(" %")) for share in shares) == pytest.approx(100.0 * verdict.worst, abs=0.5)
    assert page.results["motors"]["motors"][0]["fits"] is True
    assert "Torque and speed of all drives in the diagrams of the motors" in page.text
