"""Extended URDF: a machine written out and read in again is the same machine; files of others; what is refused."""

import math
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from kinetostat import modes
from kinetostat.exchange.formats import format_for
from kinetostat.exchange.urdf_export import texts_of
from kinetostat.exchange.urdf_file import parse
from kinetostat.exchange.urdf_import import document_of, machine_text, read_machine
from kinetostat.kinematics.status import Status
from kinetostat.machine.loading import build, bundled, load
from kinetostat.spec.document import LARGEST_FILE
from kinetostat.spec.document import parse as parse_toml
from kinetostat.studies.analysis import analyze
from machines import with_bodies
from refusals import refused

SAME = 1e-9
"""Largest relative difference in K and C: numbers are written with all digits, a compliance is turned once."""

FIVE_BAR = """<?xml version="1.0"?>
<robot name="five-bar">
  <kinetostat space="planar" platform="hand"/>
  <link name="floor"/> <link name="left crank"/> <link name="left rod"/> <link name="hand"/>
  <link name="right crank"/> <link name="right rod"/>
  <joint name="left motor" type="revolute" independent="true">
    <parent link="floor"/> <child link="left crank"/> <origin xyz="-0.1 0 0"/> <axis xyz="0 0 1"/>
    <kinetostat stiffness="5e3"/>
  </joint>
  <joint name="left elbow" type="continuous">
    <parent link="left crank"/> <child link="left rod"/> <origin xyz="-0.06 0.14 0" rpy="0 0 0.3"/> <axis xyz="0 0 2"/>
  </joint>
  <joint name="left wrist" type="fixed">
    <parent link="left rod"/> <child link="hand"/> <origin xyz="0.1853610612 0.0578037812 0" rpy="0 0 -0.3"/>
    <axis xyz="0 0 0"/>
  </joint>
  <joint name="right motor" type="revolute">
    <parent link="floor"/> <child link="right crank"/> <origin xyz="0.1 0 0"/> <axis xyz="0 0 1"/>
    <kinetostat stiffness="5e3"/>
  </joint>
  <joint name="right elbow" type="continuous">
    <parent link="right crank"/> <child link="right rod"/> <origin xyz="0.06 0.14 0"/> <axis xyz="0 0 1"/>
  </joint>
  <transmission name="drive"><joint name="right motor"/></transmission>
  <loop name="wrist" type="revolute">
    <predecessor link="hand"><origin xyz="0 0 0"/></predecessor>
    <successor link="right rod"><origin xyz="-0.16 0.11 0"/></successor>
    <axis xyz="0 0 1"/>
  </loop>
</robot>
"""


def read_text(text, tmp_path):
    path = tmp_path / "machine.urdf"
    path.write_text(text, encoding="utf-8")
    return read_machine(path)[0]


def refusal(text):
    with refused() as caught:
        document_of(parse(text.encode(), "machine.urdf"))
    message = str(caught.value)
    assert message.startswith('"machine.urdf"')
    assert message.isprintable()
    assert message.count("\n") == 0
    return message


def assert_same(ours, theirs):
    assert (ours.stiffness is None) == (theirs.stiffness is None)  # none where something is rigid
    for name in ("compliance",) if ours.stiffness is None else ("stiffness", "compliance"):
        one, other = (np.array(getattr(found, name)) for found in (ours, theirs))
        sizes = np.sqrt(np.outer(np.diag(one), np.diag(one)))
        assert (np.abs(one - other) <= SAME * sizes).all()


@pytest.mark.parametrize("name", bundled())
def test_a_machine_comes_back_as_it_was(name, tmp_path):
    settings = ['tool.offset=["10 mm", "20 mm", "-30 mm"]'] if "planar" not in name else []
    found = analyze(load(name, settings))
    text, _ = texts_of(found)
    machine = read_text(text, tmp_path)
    again = analyze(machine)
    assert again.status is Status.OK
    assert_same(found, again)
    assert again.mobility.full_cycle == found.mobility.full_cycle
    assert again.mobility.actuators == found.mobility.actuators
    assert len(machine.family_tables["pose"].__dict__) == found.mobility.full_cycle, "as many coordinates as freedoms"


@pytest.mark.parametrize(
    ("name", "stay", "go"), [("hexapod", "x=0 m", "pose.x=0.01 m"), ("delta", "", "pose.z=-0.7 m")]
)
def test_a_machine_read_in_moves_as_the_one_written_out(name, stay, go, tmp_path):
    text, _ = texts_of(analyze(load(name, [f"pose.{stay}"] if stay else [])))
    path = tmp_path / "machine.urdf"
    path.write_text(text, encoding="utf-8")
    moved = build(parse_toml(machine_text(path), "moved"), "moved", [go])
    assert_same(analyze(load(name, [go])), analyze(moved))


def test_rigid_and_free_springs_survive(tmp_path):
    settings = ["stiffness.passive_links=rigid", "stiffness.actuator.1=rigid"]
    found = analyze(load("zhang-gosselin-4dof", settings))
    again = analyze(read_text(texts_of(found)[0], tmp_path))
    assert np.allclose(again.compliance, found.compliance, rtol=SAME, atol=1e-18)
    assert len(again.rigid) == 1, "the links are rigid bodies now, the actuator is a rigid spring still"


def test_links_of_every_model_and_bearings_that_give_survive(tmp_path):
    settings = ["legs.z.distal.model=lumped", "legs.y.proximal.model=timoshenko", "legs.x.wrist.stiffness=200"]
    settings += ["legs.z.wrist.compliance=[0, 0, 0, 2e-9, 2e-9, 4e-9]"]
    found = analyze(load("tripteron", settings))
    assert_same(found, analyze(read_text(texts_of(found)[0], tmp_path)))


@pytest.mark.parametrize("name", ["planar-3rrr", "tripteron", "hexapod"])
def test_bodies_keep_their_masses_and_inertias(name, tmp_path):
    settings = ["tool.mass=5", "tool.inertia=[0.06, 0.06, 0.07, 0.01, 0, 0]", "tool.payload=2"]
    machine = with_bodies(name, [*settings, "tool.payload_centre=[0.01, 0.02, 0]"])
    text, _ = texts_of(analyze(machine))
    wanted = [mode.frequency for mode in modes(machine).modes[:6]]
    assert [mode.frequency for mode in modes(read_text(text, tmp_path)).modes[:6]] == pytest.approx(wanted, rel=1e-9)
    light = [mode.frequency for mode in modes(load(name, settings)).modes[:6]]
    assert wanted != pytest.approx(light, rel=0.1), "links are heavy here"


def test_a_link_that_telescopes_is_left_out_and_the_file_says_so():
    text, _ = texts_of(analyze(load("hexapod", ["tool.mass=5", "linear_density.legs=2"])))
    assert "telescope" in text
    assert text.count("<inertial>") == 1


def test_inertias_of_a_file_of_somebody_else(tmp_path):
    """Links that are fixed together are one body; what hangs beside the legs is named; the base stands still."""
    inertial = (
        '<inertial><origin xyz="0.1 0.2 0.3" rpy="0 0 1.2"/><mass value="{}"/>'
        '<inertia ixx="0.02" iyy="0.05" izz="0.06" ixy="0.004" ixz="0" iyz="0"/></inertial>'
    )
    extra = """<joint name="bolts" type="fixed"><parent link="left crank"/><child link="motor"/></joint>
      <joint name="pin" type="revolute"><parent link="left crank"/><child link="flag"/></joint></robot>"""
    text = FIVE_BAR.replace("</robot>", extra)
    for name, mass in (("floor", 90), ("left crank", 2), ("hand", 4), ("left rod", 6)):
        text = text.replace(f'<link name="{name}"/>', f'<link name="{name}">{inertial.format(mass)}</link>')
    text = text.replace("</robot>", '<link name="motor"><inertial><mass value="2"/></inertial></link></robot>')
    text = text.replace("</robot>", '<link name="flag"><inertial><mass value="1"/></inertial></link></robot>')
    machine = read_text(text, tmp_path)
    crank, tool = machine.tables["legs.leg 1.body 1"], machine.tables["tool"]
    assert crank.mass == 4.0
    assert crank.centre_of_mass == pytest.approx([-0.1 + 0.05, 0.1, 0.15])
    cosine, sine = math.cos(1.2), math.sin(1.2)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    arm = np.array([0.05, 0.1, 0.15])
    steiner = 4.0 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    whole = turn @ np.array([[0.02, 0.004, 0], [0.004, 0.05, 0], [0, 0, 0.06]]) @ turn.T + steiner
    entries = [whole[0, 0], whole[1, 1], whole[2, 2], whole[0, 1], whole[0, 2], whole[1, 2]]
    assert crank.inertia == pytest.approx(entries, rel=1e-12)
    assert tool.mass == 10.0, "the left rod is fixed to the hand"
    assert machine_text(tmp_path / "machine.urdf").splitlines()[2].endswith('not counted: "flag".')
    assert "which no body has" in refusal(text.replace('ixx="0.02"', 'ixx="2"'))


def test_hinges_with_something_heavy_between_them_stay_apart(tmp_path):
    text, _ = texts_of(analyze(load("hexapod")))
    cross = '<link name="leg_1_body_1"'
    heavy = f'{cross}><inertial><mass value="0.1"/></inertial></link><link name="spare"'
    assert cross in text
    kinds = [[joint["type"] for joint in leg["joints"]] for leg in document_of(parse(text.encode(), "h"))["legs"]]
    apart = text.replace(cross, heavy, 1).replace('<link name="spare"', "<unused", 1)
    document = document_of(parse(apart.encode(), "h"))
    assert [joint["type"] for joint in document["legs"][0]["joints"]] != kinds[0]
    assert document["legs"][0]["links"]["body 1"]["mass"] == 0.1
    assert "links" not in document["legs"][1]


def test_an_actuator_without_stiffness_stays_one(tmp_path):
    found = analyze(load("hexapod", ["stiffness.actuator.2=0"]))
    again = analyze(read_text(texts_of(found)[0], tmp_path))
    assert again.free == ("leg_3 drive actuator",)
    assert np.allclose(again.stiffness, found.stiffness, rtol=SAME, atol=1e-6)


def test_the_file_is_a_urdf_for_others():
    """MuJoCo, asked to give massless links a mass, builds the tree; every loop closes; two frames for each loop."""
    text, loops = texts_of(analyze(load("delta")))
    given = text.replace("<link", '<mujoco><compiler boundmass="1" boundinertia="1"/></mujoco><link', 1)
    model = mujoco.MjModel.from_xml_string(given)
    assert model.nv == sum(joint.get("type") != "fixed" for joint in ElementTree.fromstring(text).iter("joint"))
    file = parse(text.encode(), "delta.urdf")
    for loop in file.loops:
        assert np.allclose(*loop.frames, atol=1e-12)
        assert f'["{loop.links[0]}", "{loop.links[1]}"]' in loops
    assert 'name_mot: ["leg_1_drive", "leg_2_drive", "leg_3_drive"]' in loops


def test_the_loops_stand_in_a_file_beside_it(tmp_path):
    paths = format_for("urdf", None).write(analyze(load("delta")), tmp_path / "delta.urdf")
    assert [path.name for path in paths] == ["delta.urdf", "delta.yaml"]


def test_a_file_of_somebody_else(tmp_path):
    """A five-bar: turned frames, axes of any length or none, motors by attribute and transmission, a revolute loop."""
    found = analyze(read_text(FIVE_BAR, tmp_path))
    assert found.status is Status.OK
    assert found.mobility.actuators == found.mobility.full_cycle == 2
    assert found.components == ("rz", "x", "y")
    assert found.platform[0] == pytest.approx((0.0, 0.25, 0.0), abs=1e-9)


def test_an_actuator_without_a_stiffness_is_rigid(tmp_path):
    machine = read_text(FIVE_BAR.replace('<kinetostat stiffness="5e3"/>', "", 1), tmp_path)
    assert analyze(machine).rigid == ("leg 1 left motor actuator",)
    assert machine.tables["legs.leg 1.left motor"].stiffness == math.inf


def test_a_compliance_is_in_the_axes_of_its_joint(tmp_path):
    """Origin rpy is Rz(yaw) Ry(pitch) Rx(roll): a slide soft along the joint's x is soft along R x."""
    soft = [0.0] * 36
    soft[21], soft[28], soft[35] = 1e-6, 1e-9, 1e-9
    numbers = " ".join(str(c) for c in soft)
    text = f"""<robot name="post"><link name="floor"/><link name="platform"/>
      <joint name="drive" type="prismatic" independent="true"><parent link="floor"/><child link="head"/>
        <axis xyz="0 0 1"/><kinetostat stiffness="1e15"/></joint> <link name="head"/>
      <joint name="post" type="fixed"><parent link="head"/><child link="platform"/>
      <origin xyz="0 0 1" rpy="0.3 0.5 0.7"/><kinetostat compliance="{numbers}"/></joint></robot>"""
    compliance = np.array(analyze(read_text(text, tmp_path)).compliance)[3:, 3:]
    x = np.array([math.cos(0.7) * math.cos(0.5), math.sin(0.7) * math.cos(0.5), -math.sin(0.5)])
    assert x @ compliance @ x == pytest.approx(1e-6, rel=1e-6)


REFUSED = [
    (("<robot", "<model"), ("</robot>", "</model>"), "its root is <model>"),
    (("hand", "claw"), ('platform="claw"', 'platform="hand"'), 'no link is called "hand"'),
    (('child link="left rod"', 'child link="floor"'), ("", ""), "closed chain of joints"),
    (('parent link="left crank"', 'parent link="nothing"'), ("", ""), 'its parent link is "nothing"'),
    (('xyz="0.06 0.14 0"', 'xyz="0.06 0.15 0"'), ("", ""), "is open by 0.01 m"),
    (('xyz="0.06 0.14 0"', 'xyz="0.06 nan 0"'), ("", ""), "it must be 3 numbers"),
    (('xyz="0.06 0.14 0"', 'xyz="0.06 0.14"'), ("", ""), "it must be 3 numbers"),
    (('<axis xyz="0 0 2"/>', '<axis xyz="0 0 0"/>'), ("", ""), "its axis has no length"),
    (('"right elbow" type="continuous"', '"right elbow" type="floating"'), ("", ""), 'of type "floating"'),
    (('type="revolute">\n    <predecessor', 'type="screw">\n    <predecessor'), ("", ""), 'of type "screw"'),
    (('successor link="right rod"', 'successor link="hand"'), ("", ""), "must close a leg onto the platform"),
    (('successor link="right rod"', 'successor link="left crank"'), ("-0.16 0.11 0", "0.1 0.25 0"), "two legs"),
    (('<parent link="floor"/> <child link="right crank"/>', '<child link="right crank"/>'), ("", ""), "parent link"),
    (('name="left elbow"', 'id="left elbow"'), ("", ""), "no name"),
    (("</robot>", ""), ("", ""), "it is not XML"),
    (
        ('type="revolute">\n    <predecessor', 'type="fixed">\n    <predecessor'),
        ('successor link="right rod"><origin xyz="-0.16 0.11 0"/>', 'successor link="floor"><origin xyz="0 0.25 0"/>'),
        'fixes the platform to "floor"',
    ),
]


@pytest.mark.parametrize(("one", "other", "told"), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_cannot_be_is_refused_in_a_sentence(one, other, told):
    spoiled = FIVE_BAR.replace(*one)
    assert spoiled != FIVE_BAR
    assert told in refusal(spoiled.replace(*other) if other[0] else spoiled)


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE robot SYSTEM "http://example.org/robot.dtd">',
    ],
)
def test_no_entity_is_ever_defined(head):
    text = FIVE_BAR.replace('<?xml version="1.0"?>', f'<?xml version="1.0"?>{head}').replace("five-bar", "&b;&a;")
    assert "document type" in refusal(text)


def test_a_mimic_is_a_parallelogram_or_refused():
    text, _ = texts_of(analyze(load("delta")))
    assert "parallelogram" in str(document_of(parse(text.encode(), "machine.urdf")))
    assert "a joint may only mimic" in refusal(text.replace('multiplier="-1.0"', 'multiplier="-2"', 1))


def test_a_file_has_bounds(tmp_path):
    path = tmp_path / "large.urdf"
    path.write_bytes(b" " * (LARGEST_FILE + 1))
    with refused("larger than 1 MiB"):
        read_machine(path)
    with refused("cannot be read"):
        read_machine(tmp_path / "missing.urdf")
    many = "".join(f'<joint name="j{i}" type="fixed"/>' for i in range(2001))
    with refused("it needs 1 to 2,000"):
        parse(f"<robot name='r'>{many}</robot>".encode(), "many")
