"""Study files: what they may hold, and one sentence for every mistake that names the field and the remedy."""

import json
from dataclasses import replace

import jsonschema
import pytest

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT
from kinetostat.spec import document as documents
from kinetostat.spec.validation import LONGEST_MACHINE_NAME
from kinetostat.studies.bundled import bundled_studies, study_template
from kinetostat.studies.optimisation.problem import load_problem
from kinetostat.studies.optimisation.result import machine_of_design
from refusals import refused
from studies import PAPER, SMALL, written


@pytest.mark.parametrize("name", bundled_studies())
def test_every_bundled_study_fits_its_machine_and_the_schema(name, capsys):
    assert load_problem(name).space.size > 0
    main(["schema", "study"])
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(documents.parse(bundled_studies()[name], name), schema)


def test_the_schema_refuses_what_is_not_known(capsys):
    main(["schema", "study"])
    schema = json.loads(capsys.readouterr().out)
    document = documents.parse(SMALL, "")
    document["optimiser"] = {}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


@pytest.mark.parametrize("length", [5, 70, LONGEST_MACHINE_NAME])
def test_the_best_design_of_a_machine_with_a_long_name_is_told_from_the_machine(length):
    drawn = load_problem(PAPER)
    drawn = replace(drawn, machine=replace(drawn.machine, name="m" * length))
    name = machine_of_design(drawn, drawn.space.initial).name
    assert name.endswith(", optimised")
    assert len(name) <= LONGEST_MACHINE_NAME


def test_new_prints_a_study_to_start_from(capsys, tmp_path):
    assert main(["new", "study"]) == 0
    text = capsys.readouterr().out
    assert text == study_template()
    (tmp_path / "mine.toml").write_text(text)
    assert load_problem(tmp_path / "mine.toml").study.name


def test_a_machine_is_looked_for_beside_the_study(capsys, tmp_path):
    main(["new", "tricept"])
    (tmp_path / "own.toml").write_text(capsys.readouterr().out)
    text = SMALL.replace("zhang-gosselin-4dof", "own.toml").replace('"10 cm"', '"12 cm"').replace('"14 cm"', '"20 cm"')
    (tmp_path / "study.toml").write_text(text.replace('"20 cm"', '"40 cm"', 0))
    assert load_problem(tmp_path / "study.toml").machine.family.name == "tricept"


def test_list_shows_the_studies(capsys):
    main(["list"])
    assert PAPER in capsys.readouterr().out


MISTAKES = {
    'variables.0.to="14 kg"': r"variables\.0 \(geometry\.platform_radius\)\.to .*not a unit of length",
    'variables.0.to="5 cm"': "must be less than to, 5 cm",
    "variables.0.to=-1": "greater than 0",
    "variables.0.path=platform_radios": r"not a field of family .*did you mean",
    "variables.1.path=platform_radius": "set by two variables",
    "variables.0.material=3": "variables.0.material is not known; it may be path",
    "variables.0.tolerance=-1": "must not be negative",
    "variables.0.choices=[1]": "has choices; leave out from",
    "objectives.0.quantity=stifness_z": 'did you mean "stiffness_z"',
    "objectives.0.quantity=aspect": r"objectives\.0\.quantity",
    "objectives.0.over=best": r"objectives\.0\.over",
    "objectives.0.goal=minimise": r"objectives\.0\.goal .*'minimize' or 'maximize'",
    "objectives.0.weights=[1, 2]": "6 numbers of at least 0",
    "objectives.0.direction=[0, 0, 1]": "takes no direction",
    "objectives.0.quantity=stiffness_along": "needs a direction",
    "objectives.0.quantity=workspace_volume": "needs a grid of poses",
    "objectives.0.quantity=actuator_moment": "lacks an actuated revolute",
    'constraints=[{quantity="stiffness_z"}]': "either at_least or at_most",
    'constraints=[{quantity="stiffness_z", at_least="5 N*m"}]': "constraints.0.at_least",
    'constraints=[{quantity="frobenius_condition", at_most="5 mm"}]': "plain number",
    "poses.over=[1]": "poses.over.0",
    'poses.over=["x=0:1"]': "is not a range",
    'poses.over=["platform_radius=10 cm:14 cm:3"]': "is a variable and varies over the poses too",
    'poses.list=[{x="5 kg"}]': r"poses\.list\.0\.x",
    'poses.list=[{x=0, "pose.x"=1}]': r"poses\.list\.0 gives pose\.x twice",
    'poses.within="workspace"': "belong to a grid",
    "poses.required=2": "less than or equal to 1",
    "optimizer.method=ga": "optimizer.method",
    "optimizer.method=nsga2": "take genetic, gradient or hybrid",
    "optimizer.population=100000": "lower optimizer.population",
    'poses.over=["x=-2 cm:2 cm:2000", "z=66 cm:70 cm:2000"]': "at most 1,000,000",
    "optimizer.seed=-1": "greater than or equal to 0",
    "robustness.objective=worst": "needs tolerances",
    "optimiser.seed=1": "optimiser is not known; did you mean optimizer",
    "machine=zhang-gosselin-5dof": "neither a file nor a bundled machine",
    "set.stiffness.actuators=5": "stiffness.actuators is not known",
    "schema=2": "schema",
}


@pytest.mark.parametrize("setting", MISTAKES)
def test_mistakes_are_told_in_a_sentence(setting):
    with refused(MISTAKES[setting]) as caught:
        written(SMALL, setting)
    message = str(caught.value)
    assert message.endswith((".", "?"))
    assert len(message) < 900
    assert "pydantic" not in message


def test_what_is_missing_is_asked_for():
    with refused("objectives is missing"):
        written(SMALL.partition("[[objectives]]")[0])
    with refused(r"objectives\.0\.quantity is missing"):
        written(SMALL.replace('quantity = "compliance_sum"', 'goal = "minimize"'))


def test_a_volume_has_no_gradient():
    with refused("changes in steps"):
        written(
            SMALL,
            "objectives.0.quantity=workspace_volume",
            'poses.over=["x=-2 cm:2 cm:3", "z=66 cm:70 cm:3"]',
            "optimizer.method=gradient",
        )


def test_what_memory_cannot_hold_is_refused():
    grid = 'poses.over=["x=-2 cm:2 cm:300", "z=66 cm:70 cm:300"]'
    assert written(SMALL, grid).poses.count == 90_000
    with refused("lower the counts"):
        written(SMALL, grid, "optimizer.method=hybrid")
    robust = ("variables.0.tolerance=1e-4", "robustness.objective=worst", "robustness.search_samples=100")
    with refused(r"robustness\.search_samples"):
        written(SMALL, grid, *robust)


@pytest.mark.parametrize(
    ("text", "words"),
    [("{", "is damaged"), ("[]", "is damaged"), ('{"study": 1}', "not the folder of an optimisation")],
)
def test_a_folder_that_is_no_optimisation_is_refused(text, words, tmp_path, capsys):
    (tmp_path / "study.json").write_text(text)
    assert main(["optimize", str(tmp_path)]) == BAD_INPUT
    assert words in capsys.readouterr().err


def test_a_name_that_no_file_can_have_is_refused(capsys):
    assert main(["optimize", "x" * 5000]) == BAD_INPUT
    assert "neither a file nor a bundled study" in capsys.readouterr().err


def test_an_unknown_study_is_refused_with_what_was_meant(capsys):
    assert main(["optimize", "zhang-gosselin-2003"]) == BAD_INPUT
    assert 'did you mean "zhang-gosselin-2002"' in capsys.readouterr().err
