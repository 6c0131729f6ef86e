"""Files of machines written leg by leg: what is refused, and that each message names leg and joint and the way out."""

import json
import math
from pathlib import Path

import jsonschema
import pytest

from kinetostat.cli import main
from kinetostat.commands.common import NO_ANSWER
from kinetostat.kinematics.status import Status
from kinetostat.machine import loading
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.loading import build, bundled, load, template
from kinetostat.spec import document
from kinetostat.studies.analysis import analyze
from refusals import refused

GOOD = bundled()["tripteron"].partition("[limits]")[0]

MISTAKES = {
    "a leg that does not reach the platform": (
        'joins = ["distal", "platform"]',
        'joins = ["distal", "hand"]',
        ['leg "z" does not reach the platform', '"wrist"', '"hand"', 'joins = ["distal", "platform"]'],
    ),
    "a disconnected chain": (
        'joins = ["carriage", "proximal"]',
        'joins = ["trolley", "proximal"]',
        ['leg "z", joint "shoulder" starts at "trolley"', "disconnected", 'joins = ["carriage", "proximal"]'],
    ),
    "a leg that does not start at the base": (
        'joins = ["base", "carriage"]',
        'joins = ["ground", "carriage"]',
        ['leg "z", joint "slide" starts at "ground"', 'a leg starts at "base"'],
    ),
    "a body passed twice": (
        'joins = ["proximal", "distal"]',
        'joins = ["proximal", "carriage"]',
        ['leg "z", joint "elbow" leads to "carriage" too early', "only a parallelogram can be written"],
    ),
    "a leg that branches": (
        'joins = ["distal", "platform"]',
        'joins = ["carriage", "platform"]',
        ['leg "z", joint "wrist" starts at "carriage"', 'has left "carriage" already', "a leg does not branch"],
    ),
    "an axis of zero length": (
        "axis = [0, 0, 1], actuated",
        "axis = [0, 0, 0], actuated",
        ['leg "z", joint "slide": axis has no length', "axis = [0, 0, 1]"],
    ),
    "two legs with one name": ('name = "y"', 'name = "z"', ['two legs are called "z"', "name of its own"]),
    "two joints with one name": ('name = "elbow"', 'name = "shoulder"', ['leg "z": two joints are called "shoulder"']),
    "a leg without a name": ('name = "y"', "name = 5", ["the name of leg 2 is 5", 'name = "leg 2"']),
    "an actuated joint without stiffness": (
        ', stiffness = "1e6 N/m"',
        "",
        ['leg "z", joint "slide" is actuated but has no stiffness', 'stiffness = "20 N/um"', '"rigid"'],
    ),
    "a stiffness of another kind": (
        'stiffness = "1e6 N/m"',
        'stiffness = "1e6 N*m/rad"',
        ["legs.z.slide.stiffness", '"N*m/rad" is not a unit of linear stiffness'],
    ),
    "an unknown type": ('type = "revolute"', 'type = "revolve"', ['joint "shoulder"', 'did you mean "revolute"?']),
    "an actuated ball joint": (
        'type = "prismatic"',
        'type = "spherical"',
        ['joint "slide" is spherical; only revolute'],
    ),
    "an unknown section": ('section = "bar"', 'section = "rod"', ['link "proximal": section is "rod"', "bar"]),
    "an unknown link": ("links = { proximal", "links = { upper", ['leg "z": links name is "upper"', "proximal"]),
    "a link without length": (
        "point = [0.7177071733467426, -0.2177071733467426, 0.5]",
        "point = [0, 0, 0.5]",
        ['leg "z", link "proximal" has no length', '"shoulder" and "elbow"'],
    ),
    "two coordinates for a point": (
        "point = [0, 0, 0.5], axis = [0, 0, 1], actuated",
        "point = [0, 0], axis = [0, 0, 1], actuated",
        ["legs.z.slide.point is [0, 0]", "give 3"],
    ),
    "an unknown shape": ('"round"', '"hex"', ['cross-section "bar": shape is "hex"', "rectangle"]),
    "no material": ('youngs_modulus = "70 GPa"', "", ['cross-section "bar": material is missing', "aluminium"]),
    "an unknown coordinate": ("[pose]", "[pose]\nq = 1", ['a name in [pose] is "q"', "roll"]),
    "no pose": ('x = "0.5 m"\ny = "0.5 m"\nz = "0.5 m"', "", ["[pose] must give the task coordinates"]),
    "no legs": (GOOD[GOOD.index("[[legs]]") :], "", ["needs 1 to 24 legs"]),
    "a leg without joints": (GOOD[GOOD.index("[[legs]]") :], '[[legs]]\nname = "a"\njoints = []', ["has 0 joints"]),
    "a link without a model": ('model = "beam", section', "section", ['link "proximal": model is missing', "rigid"]),
    "a matrix where none belongs": (
        'model = "beam", section',
        'model = "matrix", section',
        ['link "proximal"', 'model = "matrix" needs compliance'],
    ),
    "a matrix with negative energy": (
        'model = "beam", section = "bar"',
        'model = "matrix", compliance = [1, 1, 1, 1, 1, -1]',
        ["no negative eigenvalue"],
    ),
    "a coordinate out of the plane": ('family = "legs"', 'family = "legs"\nspace = "planar"', ['"z"', "x, y, yaw"]),
}


def refusal(text, settings=()):
    with refused() as caught:
        build(document.parse(text, "mine.toml"), "mine.toml", settings)
    return str(caught.value)


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_refused_with_leg_and_joint(old, new, words):
    assert old in GOOD
    message = refusal(GOOD.replace(old, new, 1))
    assert message.startswith('"mine.toml": ')
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("legs.q.slide.stiffness=3", ['"q"', "z, y, x"]),
        ("legs.z.slyde.stiffness=3", ['"slyde"', 'did you mean "slide"?']),
        ('legs.z.slide.stiffness="-1 N/m"', ["legs.z.slide.stiffness", "negative"]),
        ('sections.bar.diameter="0 mm"', ["sections.bar.diameter", "greater than 0"]),
    ],
)
def test_a_mistaken_override_is_refused(setting, words):
    message = refusal(GOOD, [setting])
    for word in words:
        assert word in message


def test_overrides_reach_every_number():
    machine = load("tripteron", ['legs.z.slide.stiffness="rigid"', 'sections.bar.diameter="10 cm"', "pose.x=0.4"])
    assert machine.tables["legs.z.slide"].stiffness == float("inf")
    assert machine.tables["sections.bar"].diameter == 0.1


def test_a_pose_off_the_constraint_is_refused_with_the_nearest_one():
    found = analyze(load("tripteron", ['pose.yaw="3 deg"', "pose.x=0.4"]))
    assert found.status is Status.OUT_OF_REACH
    assert "nearest admissible pose is x 0.4 m, y 0.5 m, z 0.5 m, roll 0 rad, pitch 0 rad, yaw 0 rad" in found.message


def test_a_pose_that_says_too_little_is_refused():
    text = GOOD.replace('x = "0.5 m"\ny = "0.5 m"\nz = "0.5 m"', 'x = "0.5 m"')
    found = analyze(build(document.parse(text, "mine.toml"), "mine.toml"))
    assert found.status is Status.SINGULAR
    assert "not determined" in found.message
    assert "Give further coordinates in [pose]" in found.message


def test_the_template_is_a_file_that_loads():
    assert build(document.parse(template("legs"), "new"), "new").family.name == "legs"


def test_the_template_has_joints_however_the_shortest_file_writes_its_cables(monkeypatch):
    joints, cables = bundled()["tripteron"], bundled()["cogiro"].replace('type      = "cable"', 'type = "cable"')
    assert len(cables) < len(joints)
    monkeypatch.setattr(loading, "bundled", lambda: {"cables": cables, "joints": joints})
    assert template("legs") == joints


@pytest.fixture(scope="module")
def schema():
    """What checks files against the schema, which is itself checked once, and goes through JSON."""
    schema = machine_schema()
    assert json.loads(json.dumps(schema, allow_nan=False)) == schema
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", bundled())
def test_bundled_files_fulfil_the_schema(name, schema):
    schema.validate(document.parse(bundled()[name], name))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('type = "revolute"', 'type = "revolve"'),
        ('joins = ["base"', 'join = ["base"'),
        ('family = "legs"', 'family = "leg"'),
        ('name   = "', 'name   = "\\u0007'),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(old, new, schema):
    with pytest.raises(jsonschema.ValidationError):
        schema.validate(document.parse(GOOD.replace(old, new, 1), "mine"))


def test_machines_with_one_plan_are_one_family():
    """So that they share sections and compiled programs; other numbers are the same plan, another link model is not."""
    numbers = build(document.parse(GOOD.replace('"15 cm"', '"12 cm"'), "thin"), "thin")
    model = build(document.parse(GOOD.replace('model = "beam"', 'model = "rigid"', 1), "stiff"), "stiff")
    assert numbers.family is load("tripteron").family
    assert model.family is not numbers.family


SLIDE = 'actuated = true, stiffness = "1e6 N/m"'


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, ["2 for 3 freedoms; none is in z", "by the twist z ", "give another joint an actuator"]),
        (3, ["0 for 3 freedoms. "]),
    ],
)
def test_a_missing_actuator_is_no_singularity(count, words):
    found = analyze(build(GOOD.replace(f", {SLIDE}", "", count)))
    assert found.message.startswith("Actuators are missing: ")
    assert "singular" not in found.message
    for word in words:
        assert word in found.message


def test_a_flexure_that_holds_a_slide_stands_for_an_actuator():
    found = analyze(build(GOOD.replace(SLIDE, 'stiffness = "1e6 N/m"', 1)))
    assert found.compliance_diagonal == pytest.approx(analyze(build(GOOD)).compliance_diagonal)


CASES = Path(__file__).parents[1] / "cases"


def test_a_link_behind_a_parallelogram_begins_at_its_far_side():
    """A cantilever of 1 m: C = L^3 / (3 E I), and the mass of 1 m of it."""
    analysis = analyze(load(CASES / "link-behind-parallelogram.toml"))
    assert analysis.compliance_diagonal[5] == pytest.approx(5.1738e-06, rel=1e-5)
    assert analysis.moving_mass == pytest.approx(7850.0 * math.pi / 4.0 * 0.05**2, rel=1e-9)


def test_legs_with_and_without_a_carriage_are_of_two_builds(capsys):
    assert main(["analyze", str(CASES / "legs-of-two-builds.toml")]) == NO_ANSWER
    said = capsys.readouterr()
    assert "Actuators are missing: 2 for 6 freedoms" in said.out + said.err


def test_what_is_said_of_rigid_parts_is_true_of_the_stiffness_shown():
    """A rigid slide between links that flex leaves K finite."""
    analysis = analyze(load(CASES / "one-rigid-slide.toml"))
    assert analysis.rigid == ("left slide actuator",)
    assert analysis.stiffness is not None
    assert analysis.rank == 6
    assert "so that K is finite" in analysis.message
    assert "infinite" not in analysis.message


CANNOT_BE_WRITTEN = {
    "shared-carriage": [
        'leg "b", joint "p" starts at "carriage"',
        '"carriage" is a body of leg "a"',
        "A body that carries two legs cannot be written",
        "one leg with a parallelogram",
        'add the joints between "base" and "carriage"',
    ],
    "wrist-body": [
        'leg "b" does not reach the platform: its last joint "b" ends at "wrist"',
        'If "wrist" is a slip for "platform", write joins = ["rod", "platform"]',
        'otherwise add the joints between "wrist" and "platform"',
        "one whose parts move against each other cannot be written",
    ],
}


@pytest.mark.parametrize("name", CANNOT_BE_WRITTEN)
def test_advice_about_a_body_out_of_place_does_not_make_another_machine(name, capsys):
    assert main(["analyze", str(CASES / f"{name}.toml")]) == 2
    said = capsys.readouterr().err
    assert '["base", "rod"]' not in said
    for words in CANNOT_BE_WRITTEN[name]:
        assert words in said


def written_out(name, capsys):
    assert main(["new", "--legs-of", name]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("name", ["tricept", "tricept-rus", "passive-leg-3dof-pu", "planar-3rrr"])
def test_a_machine_written_out_leg_by_leg_keeps_its_limits_and_its_joints(name, tmp_path, capsys):
    file = tmp_path / "legs.toml"
    file.write_text(written_out(name, capsys))
    assert main(["check", str(file)]) == 0
    assert "The pose can be reached and the machine resists every load." in capsys.readouterr().out
    kept, drawn = (vars(load(machine).tables["limits"]) for machine in (str(file), name))
    left_out = {limit for limit in kept if kept[limit] != pytest.approx(drawn[limit])}
    assert left_out == ({"platform_joint_angle"} if "Left out" in file.read_text() else set())
    assert "joint 2" not in file.read_text()


def test_a_hooke_joint_described_axis_by_axis_is_no_straight_leg(tmp_path, capsys):
    """Its two centres coincide: they had been taken for the ends of a rod, whose direction was compared."""
    whole = next(line for line in written_out("tricept", capsys).splitlines() if '"Hooke joint"' in line)
    first, second = (whole.partition(f"{n}_axis = ")[2].partition("]")[0] + "]" for n in ("first", "second"))
    parts = [
        f'  {{ name = "U{i}", type = "revolute", joins = {joins}, point = [0, 0, 0], axis = {axis} }},'
        for i, joins, axis in ((1, '["base", "cross"]', first), (2, '["cross", "body 1"]', second))
    ]
    file = tmp_path / "legs.toml"
    file.write_text(written_out("tricept", capsys).replace(whole, "\n".join(parts)))
    assert main(["analyze", str(file), "--json"]) == 0
    answer, family = json.loads(capsys.readouterr().out), analyze(load("tricept"))
    assert answer["status"] == "ok"
    assert answer["compliance_diagonal"] == pytest.approx(family.compliance_diagonal, rel=1e-8)
