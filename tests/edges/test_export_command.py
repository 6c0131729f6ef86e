"""`kinetostat export` and `kinetostat new --from`, as a new user types them."""

import configparser
import shlex
import struct
from xml.etree import ElementTree

import numpy as np
import pytest

from cad import needs_cad
from kinetostat import load, under_load
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE, NO_ANSWER
from kinetostat.commands.documents import EXPORT_FORMATS
from kinetostat.exchange import solids
from kinetostat.exchange.formats import FORMATS
from kinetostat.machine.loading import bundled
from kinetostat.machine.parameters import with_values
from kinetostat.spec.installation import extra_command

MACHINE = "zhang-gosselin-4dof"


FORMS = [pytest.param(one, marks=needs_cad if one.name == "step" else (), id=one.name) for one in FORMATS]

WRITTEN_OF = {("inputs", "outputs"): "planar-3rpr", ("over",): "delta"}
"""By the options of a format. Programs have rest and command, which take long for larger machines: `test_c_source`,
`test_c_programs` and `test_machine_page` ask those. Maps of heights are of a tool that moves along x, y and z."""


@pytest.mark.parametrize("one", FORMS)
def test_every_format_is_written(one, tmp_path, capsys):
    path = tmp_path / f"out{one.suffix}"
    loads = ["--set", "tool.mass=5 kg", "--set", "load.gravity=[0, 0, -9.81]"]
    machine = WRITTEN_OF.get(one.options, MACHINE)
    assert main(["export", machine, *loads, "--to", one.name, "-o", str(path)]) == DONE
    assert str(path) in capsys.readouterr().out.replace("\n", "")
    assert path.stat().st_size > 100
    assert not [other for other in tmp_path.iterdir() if other.name.startswith(".")]


def test_help_names_every_format():
    assert list(EXPORT_FORMATS) == [form.name for form in FORMATS]


def test_the_suffix_names_the_format_and_the_machine_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", MACHINE, "-o", "k.inp"]) == DONE
    assert "*USER ELEMENT" in (tmp_path / "k.inp").read_text()
    assert main(["export", MACHINE, "--to", "nastran"]) == DONE
    assert (tmp_path / f"{MACHINE}.bdf").is_file()


def test_glb_is_gltf_binary(tmp_path):
    path = tmp_path / "machine.glb"
    assert main(["export", MACHINE, "-o", str(path)]) == DONE
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))


@needs_cad
def test_step_is_for_cad_programs_by_either_suffix(tmp_path, capfd):
    for name in ("machine.step", "machine.STP"):
        assert main(["export", MACHINE, "-o", str(tmp_path / name)]) == DONE
        assert capfd.readouterr().out.count("\n") < 3, "the writer itself says nothing"
    assert (tmp_path / "machine.step").read_bytes() == (tmp_path / "machine.STP").read_bytes()
    assert "AUTOMOTIVE_DESIGN" in (tmp_path / "machine.step").read_text("ascii")


def test_step_without_its_extra_is_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(solids, "find_spec", lambda _: None)
    assert main(["export", MACHINE, "-o", str(tmp_path / "machine.step")]) == BAD_INPUT
    assert extra_command("cad") in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())


def test_step_says_which_library_of_the_system_it_lacks(tmp_path, monkeypatch, capsys):
    def failing(name):
        raise ImportError("libGL.so.1: cannot open shared object file")

    monkeypatch.setattr(solids, "import_module", failing)
    assert main(["export", MACHINE, "-o", str(tmp_path / "machine.step")]) == BAD_INPUT
    assert "libGL.so.1: cannot open shared object file. On Debian" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        ([MACHINE], BAD_INPUT, "name it with --to"),
        ([MACHINE, "--to", "iges"], BAD_INPUT, "mjcf, mjcf-vibration, urdf"),
        ([MACHINE, "-o", "a.docx"], BAD_INPUT, "one of these suffixes"),
        (["nope", "--to", "csv"], BAD_INPUT, "neither a file nor a bundled machine"),
        ([MACHINE, "--to", "csv", "--set", "pose.z=3 m"], NO_ANSWER, "span 3000 mm"),
        ([MACHINE, "--to", "ansys", "--set", "stiffness.passive_links=rigid"], BAD_INPUT, "K is not finite"),
    ],
)
def test_what_cannot_be_written_is_said(arguments, code, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *arguments]) == code
    message = capsys.readouterr().err
    assert told in message
    assert "Traceback" not in message
    assert not list(tmp_path.iterdir()), "nothing is left behind"


def test_a_place_that_cannot_be_written_keeps_what_was_there(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["export", MACHINE, "-o", str(tmp_path / "file" / "k.csv")]) == BAD_INPUT
    assert "cannot be written" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "mine"


def test_a_machine_written_out_is_read_in(tmp_path, capsys):
    urdf, own = tmp_path / "tripteron.urdf", tmp_path / "own.toml"
    assert main(["export", "tripteron", "-o", str(urdf)]) == DONE
    capsys.readouterr()
    assert main(["new", "--from", str(urdf)]) == DONE
    own.write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["check", str(own)]) == DONE
    assert "legs.z.slide.stiffness" in capsys.readouterr().out


@pytest.mark.parametrize("to", ["mjcf", "urdf", pytest.param("step", marks=needs_cad), "nastran", "abaqus", "ansys"])
def test_a_name_stays_a_name(to, tmp_path):
    """Whatever people call their machine, it adds no line and no element to a file."""
    own, path = tmp_path / "own.toml", tmp_path / "out"
    text = bundled()["hexapod"].replace('name   = "', 'name   = "a, SPC,1,2\\"<x/>&é ', 1)
    own.write_text(text, encoding="utf-8")
    assert main(["export", str(own), "--to", to, "-o", str(path)]) == DONE
    written = path.read_text(encoding="utf-8")
    assert "\nSPC" not in written
    if to in ("mjcf", "urdf"):
        root = ElementTree.fromstring(written)
        assert 'a, SPC,1,2"<x/>&é' in (root.get("model") or root.get("name"))


def test_the_loops_do_not_replace_the_machine(tmp_path, capsys):
    assert main(["export", MACHINE, "--to", "urdf", "-o", str(tmp_path / "m.yaml")]) == BAD_INPUT
    assert "another suffix" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_new_wants_a_family_or_a_file(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["new"])
    assert ended.value.code == BAD_INPUT
    assert "FAMILY --from --legs-of is required" in capsys.readouterr().err
    assert main(["new", "--from", "missing.urdf"]) == BAD_INPUT
    assert '"missing.urdf" cannot be read' in capsys.readouterr().err


HEIGHTS = ["--set", "tool.mass=2 kg", "--set", "load.gravity=[0, 0, -9.81]", "--over", "x=-10 cm:10 cm:3"]
HEIGHTS += ["--over", "y=-6 cm:9 cm:4"]


def test_a_tool_that_is_raised_by_the_map_is_at_its_height(tmp_path):
    mesh, chart = tmp_path / "bed.cfg", tmp_path / "heightmap.csv"
    assert main(["export", "delta", *HEIGHTS, "-o", str(mesh)]) == DONE
    assert main(["export", "delta", *HEIGHTS, "--to", "reprapfirmware", "-o", str(chart)]) == DONE
    settings = configparser.ConfigParser()
    settings.read(mesh)
    profile = settings["bed_mesh bed"]
    heights = np.array([row.split(",") for row in profile["points"].split("\n") if row], dtype=float)
    assert heights.shape == (int(profile["y_count"]), int(profile["x_count"])) == (4, 3)
    assert [float(profile[name]) for name in ("min_x", "max_x", "min_y", "max_y")] == [-100, 100, -60, 90]
    assert profile["algo"] == "lagrange"
    lines = chart.read_text().splitlines()
    assert lines[0].startswith("RepRapFirmware height map file v2")
    assert lines[2] == "-100.000,100.000,-60.000,90.000,-1.000,100.000,50.000,3,4"
    assert np.allclose(np.array([row.split(",") for row in lines[3:]], dtype=float), heights, atol=6e-5)
    machine = load("delta", ["tool.mass=2 kg", "load.gravity=[0, 0, -9.81]", "load.state=loaded"])
    for row, y in enumerate([-0.06, -0.01, 0.04, 0.09]):
        raised = with_values(machine, {"pose.x": 0.1, "pose.y": y, "pose.z": -0.75 + 1e-3 * heights[row, 2]})
        assert under_load(raised).displacement[5] == pytest.approx(-1e-3 * heights[row, 2], abs=1e-9)
    assert heights.min() > 0.05, "mm, upwards"


def test_ranges_with_holes_are_refused_with_some_without(tmp_path, capsys):
    loads = HEIGHTS[:4]
    assert main(["export", "hexapod", *loads, "--to", "klipper", "-o", str(tmp_path / "bed.cfg")]) == BAD_INPUT
    message = " ".join(capsys.readouterr().err.split())
    ranges = shlex.split(message.partition("for instance ")[2].removesuffix("."))
    assert ranges[::2] == ["--over", "--over"]
    assert main(["export", "hexapod", *loads, "--to", "klipper", "-o", str(tmp_path / "bed.cfg"), *ranges]) == DONE


@pytest.mark.parametrize(
    ("machine", "options", "says"),
    [
        ("delta", [], "Nothing loads the machine"),
        ("hexapod", [], "Nothing loads the machine"),
        ("tricept", [], "has no x and no y and no z"),
        ("zhang-gosselin-4dof", [], "has no y,"),
        ("delta", ["--over", "x=0 mm:1 mm:3"], "ranges of x and of y with at least three points"),
        ("delta", ["--over", "x=1 mm:9 mm:3:log", "--over", "y=0 mm:9 mm:3"], "needs evenly spaced points"),
        ("delta", [*HEIGHTS[:4], "--over", "x=0 m:0.9 m:3", "--over", "y=0 m:0.1 m:3"], "no mesh with holes"),
        ("delta", ["--inputs", "x"], "The format klipper has no inputs to choose"),
    ],
)
def test_what_no_map_of_heights_can_hold_is_refused(machine, options, says, tmp_path, capsys):
    assert main(["export", machine, *options, "--to", "klipper", "-o", str(tmp_path / "bed.cfg")]) == BAD_INPUT
    assert says in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())
