"""What people write wrongly, and surroundings that lack something: a sentence each, and no traceback."""

import os
import subprocess
import sys

import pytest

from kinetostat import analyze, build, load, load_problem, plot
from kinetostat.exchange.urdf_import import machine_text
from kinetostat.spec.document import parse
from refusals import refused

LINKS = '<link name="{}"/><link name="{}"/><link name="platform"/>'
COAXIAL = """
schema = 1
name = "coaxial"
family = "legs"
platform.point = [0, 0, 0]
pose.yaw = 0
[[legs]]
name = "only"
joints = [
  { name = "drive", type = "revolute", joins = ["base", "arm"], point = [0, 0, 0], axis = [0, 0, 1], actuated = true, stiffness = 1e5 },
  { name = "wrist", type = "revolute", joins = ["arm", "platform"], point = [0, 0, 0], axis = [0, 0, 1] },
]
"""  # noqa: E501


def kinetostat(*words, **surroundings):
    command = [sys.executable, "-m", "kinetostat", *words]
    environment = {**os.environ, **surroundings}
    return subprocess.run(command, capture_output=True, env=environment, check=False)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("legs=5", "legs is 5; it needs 1 to 24 legs"),
        ("legs=[]", "legs is []; it needs 1 to 24 legs"),
        ("legs.z=5", 'leg "z" is 5; it must be a table'),
        ("pose=5", "[pose] must give the task coordinates"),
    ],
)
def test_an_override_that_is_no_leg_is_refused(setting, words):
    with refused() as refusal:
        load("tripteron", setting)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    "text", ["display.units = '{}'", "requirements.{} = 5", "stiffness.actuator.'{}' = 5"], ids=["unit", "name", "key"]
)
def test_a_word_as_long_as_a_file_is_cut_in_a_message(text):
    with refused() as refusal:
        build('schema = 1\nname = "m"\nfamily = "hexapod"\n' + text.format("z" * 5000))
    assert "zzz…" in str(refusal.value)
    assert len(str(refusal.value)) < 2000


def test_more_copies_than_legs_are_refused_before_they_are_made():
    with refused("copies is 9223372036854775808; it must be the number of legs, 1 to 24"):
        build(COAXIAL.replace('name = "only"', 'name = "only"\ncopies = 9223372036854775808'))


def test_a_list_without_entries_among_rigidities_is_refused():
    with refused(r"stiffness\.passive_links"):
        load("zhang-gosselin-4dof", ["stiffness.passive_links=[[], 5]"])


def test_a_date_is_no_number_of_a_study():
    with refused(r"set\.pose\.z is datetime\.date\(1979, 5, 27\); it must be a number"):
        load_problem("zhang-gosselin-2002", ["set={'pose.z'=1979-05-27}"])


def test_a_link_that_a_urdf_defines_twice_is_named(tmp_path):
    path = tmp_path / "twice.urdf"
    joint = '<joint name="j" type="revolute"><parent link="arm"/><child link="platform"/></joint>'
    path.write_text(f'<robot name="r">{LINKS.format("arm", "arm")}{joint}</robot>', encoding="utf-8")
    with refused('defines the link "arm" twice'):
        machine_text(path)


def test_joints_that_are_all_at_the_platform_point_have_an_answer():
    assert "actuation singularity" in analyze(build(COAXIAL)).message


def test_a_leg_without_a_place_does_not_say_how_long_it_would_be():
    message = analyze(load("passive-leg-4dof-rus", "pose.z=3 m")).message
    assert "would have to span 3000 mm" in message
    assert "nan" not in message


def test_dollar_signs_in_a_name_are_no_mathematics():
    document = {**parse(COAXIAL, ""), "name": "5 $ or 6 $"}
    title = plot(build(document))._suptitle
    assert title.get_text() == "5 $ or 6 $"
    assert not title.get_parse_math()


def test_json_is_whole_where_the_output_knows_few_characters():
    done = kinetostat("analyze", "hexapod", "--json", PYTHONIOENCODING="ascii")
    assert done.returncode == 0
    assert done.stdout.isascii()
    assert kinetostat("check", "hexapod", PYTHONIOENCODING="ascii").returncode == 0


def test_a_window_system_that_is_not_there_does_not_matter(tmp_path):
    done = kinetostat("sweep", "hexapod", "--vary", "z=12cm:14cm:2", "-o", str(tmp_path), MPLBACKEND="nonsense")
    assert (done.returncode, done.stderr) == (0, b"")


def test_closed_output_is_no_mistake():
    done = subprocess.run(f'"{sys.executable}" -m kinetostat list >&- 2>&-', shell=True, check=False)
    assert done.returncode == 0
