"""The command `budget`: what it prints, the files it writes, and what it refuses, at the edge of the program."""

import csv
import json

import numpy as np
import pytest
import xarray as xr

from kinetostat import budget, load, plot, save
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE
from refusals import refused

JOINTS = ["--tolerance", "joints=0.05 mm", "--samples", "256"]
DELTA = ["--tolerance", 'joints=["0.05 mm", "0.02 deg"]', "--tolerance", "zeros=0.01 deg", "--samples", "256"]


def printed(capsys, *arguments):
    """What a command prints."""
    assert main(["budget", *arguments]) == DONE
    return capsys.readouterr().out


def test_the_answer_comes_first_and_contributions_follow(capsys):
    text = " ".join(printed(capsys, "delta", *DELTA).split())
    order = [
        "Delta error of the tool by 69", "95 % of all machines", "no actuator moves rx ry rz", "rx (parasitic)",
        "lines of [tolerances]", "legs", "largest single tolerances", "further ones (--full)",
    ]  # fmt: skip
    places = [text.index(words) for words in order]
    assert places == sorted(places)
    assert "parasitic rx" not in text
    assert "parasitic rx" in printed(capsys, "delta", *DELTA, "--full")


def test_json_has_everything_in_si(capsys):
    data = json.loads(
        printed(capsys, "hexapod", *JOINTS, "--exact", "16", "--allocate", "0.05 mm", "--along", "0,0,1", "--json")
    )
    assert data["tolerances"] == {"joints": "0.05 mm"}
    assert data["measures"]["position"] == "m"
    assert 1e-5 < data["errors"]["usual"]["position"] < data["errors"]["worst"]["position"] < 1e-3
    assert data["leading_measure"] == "along"
    assert sum(row["shares"]["position"] for row in data["contributions"]) == pytest.approx(1.0)
    assert {row["tolerance"] for row in data["contributions"]} == {5e-5}
    assert data["exact"]["machines"] == 16
    assert data["allocation"]["lines"] == ["joints"]
    assert data["allocation"]["measure"] == "along"


def test_poses_of_a_file_and_grids_become_files(tmp_path, capsys):
    poses = tmp_path / "poses.csv"
    poses.write_text("x [mm], z [mm]\n0, 135\n5, 140\n0, 900\n")
    text = printed(capsys, "hexapod", str(poses), *JOINTS, "-o", str(tmp_path / "out"))
    assert "1 of 3 poses: no result" in text
    assert "everywhere" in text
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "budget.json", "contributions.csv", "poses.csv", "budget.nc", "budget-contributions.png", "budget-curves.png",
        "kinetostat.sha256",
    }  # fmt: skip
    rows = list(csv.DictReader((tmp_path / "out" / "poses.csv").read_text().splitlines()))
    assert [row["status"] == "ok" for row in rows] == [True, True, False]
    assert float(rows[1]["x [m]"]) == 0.005
    assert rows[2]["usual position [m]"] == ""
    with xr.open_dataset(tmp_path / "out" / "budget.nc") as dataset:
        assert dataset["usual_position"].dims == ("pose",)
        assert dataset["usual_position"].values[1] == float(rows[1]["usual position [m]"])
        assert dataset["usual_position"].units == "m"
    ranked = list(csv.DictReader((tmp_path / "out" / "contributions.csv").read_text().splitlines()))
    shares = [float(row["share position"]) for row in ranked]
    assert shares == pytest.approx(sorted(shares, reverse=True))
    assert sum(shares) == pytest.approx(1.0)


def test_over_two_coordinates_there_is_a_map(tmp_path):
    machine, ranges = load("planar-3rpr"), ["x=-5 cm:5 cm:3", "y=-4 cm:4 cm:2"]
    answer = budget(machine, ranges=ranges, tolerances={"joints": "0.05 mm"}, samples=64)
    assert plot(answer, "map").axes[0].get_xlabel() == "x (mm)"
    assert "position" in plot(answer).axes[-1].get_legend().get_texts()[0].get_text()
    with xr.open_dataset(save(answer, tmp_path / "map.nc")) as dataset:
        assert dataset["rms_position"].sizes == {"x": 3, "y": 2}
        here = machine.with_values({"x": dataset["x"].values[2], "y": dataset["y"].values[1]})
        alone = budget(here, tolerances={"joints": "0.05 mm"}, samples=64)
        assert dataset["rms_position"].values[2, 1] == pytest.approx(alone.size("rms", "position")[0])
    assert json.loads(save(answer, tmp_path / "map.json").read_text())["poses"]["pose.x"][-1] == pytest.approx(0.05)


def test_every_number_that_may_be_off_is_listed_with_its_line(capsys):
    text = " ".join(printed(capsys, "hexapod", "--list", "--set", "tolerances.zeros=0.02 mm").split())
    assert "legs.leg 1.actuator.zero zero of the actuator of leg 1 length zeros: 0.02 mm" in text
    assert text.count("zeros: 0.02 mm") == 6
    assert text.count(" exact") > 60
    assert "geometry.base_radius" in text


def test_a_later_option_overrides_the_file(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    save(load("hexapod", ["tolerances.joints=1 mm", "tolerances.zeros=0.5 mm"]), file)
    data = json.loads(printed(capsys, str(file), *JOINTS, "--json"))
    assert data["tolerances"] == {"zeros": "0.5 mm", "joints": "0.05 mm"}
    assert main(["check", str(file)]) == DONE
    assert "tolerances.joints" in capsys.readouterr().out


def test_allocation_says_which_lines_to_tighten(capsys):
    text = printed(capsys, "hexapod", *JOINTS, "--tolerance", "gains=1 ppm", "--allocate", "0.05 mm")
    rows = {
        line.split()[0]: line for line in text[text.index("Tolerances of least cost") :].splitlines() if line.split()
    }
    assert "tighten" in rows["joints"]
    assert "loosen" in rows["gains"]
    assert "µm/m" in rows["gains"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "no tolerances"),
        (["--tolerance", "joints=5"], "tolerances.joints is 5"),
        (["--tolerance", "joints"], "WHAT=VALUE"),
        ([*JOINTS, "--allocate", "heavy"], "allocate, the wanted error"),
        (["nowhere.csv", *JOINTS], "cannot be read"),
        ([*JOINTS, "--over", "geometry.base_radius=1:2:3"], "not a coordinate of the pose"),
        ([*JOINTS, "--set", "pose.z=9 m"], "no result at the pose"),
    ],
)
def test_mistakes_are_refused_in_a_sentence(arguments, reason, capsys):
    assert main(["budget", "hexapod", *arguments]) == BAD_INPUT
    message = capsys.readouterr().err
    assert reason in message
    assert message.count("\n") == 1


def test_python_refuses_what_is_not_a_tolerance():
    with refused("a dictionary of tolerances"):
        budget(load("hexapod"), tolerances=["joints"])


def test_the_numbers_of_two_calls_are_the_same():
    first, second = (budget(load("hexapod"), tolerances={"joints": "0.05 mm"}, samples=512) for _ in range(2))
    assert np.array_equal(first.spread.usual, second.spread.usual)
    assert first == second
