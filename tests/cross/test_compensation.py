"""A machine that is commanded as its fit says stands where it should: by the exact model of its errors."""

import json

import numpy as np
import pytest

from kinetostat.accuracy.built import as_built, model_at_home
from kinetostat.accuracy.model import error_model
from kinetostat.exchange.leg_by_leg import built_text
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import build, changed, load
from kinetostat.machine.parameters import values
from kinetostat.numerics.motions import exponential
from kinetostat.spec.errors import InputError
from kinetostat.studies.assembly_modes import forward
from kinetostat.studies.commanding import command
from synthetic_measurements import truth_of


def fitted(folder, machine, truth):
    """What `identify -o` would write of a machine whose errors it has found exactly."""
    model, built = model_at_home(machine), as_built(machine, truth)
    (folder / "machine.toml").write_text(built_text(machine, built.configuration, []))
    unknowns = [
        {"path": error.path, "group": error.group, "value": value, "half_interval_95": 0.0}
        for error, value in zip(model.errors, truth, strict=True)
        if value
    ]
    covariance = np.zeros((len(unknowns), len(unknowns))).tolist()
    record = {"machine": machine.name, "family": machine.family.name, "unknowns": unknowns, "covariance": covariance}
    record["home"] = {"actuators": built.coordinates, "senses": built.senses}
    (folder / "fit.json").write_text(json.dumps(record))
    return load(folder / "machine.toml")


@pytest.mark.parametrize("name", ["hexapod", "hexapod-rus", "delta", "orthoglide"])
def test_zeros_gains_and_geometry_are_compensated_together(name, tmp_path):
    machine = load(name)
    # A file leg by leg counts rotations from its home pose, which is that of the drawn machine.
    machine = changed(
        machine, {path: 0.0 for path in values(machine) if path in ("pose.roll", "pose.pitch", "pose.yaw")}
    )
    truth = truth_of(model_at_home(machine), ("geometry", "zeros", "gains"))
    built = fitted(tmp_path, machine, truth)
    wanted = {
        path: value + 0.03 * (value or 0.1) for path, value in values(machine).items() if path.startswith("pose.")
    }
    given = {path.removeprefix("pose."): [value] for path, value in wanted.items()}
    answer = command(built, given, fit=tmp_path)
    commands = dict(zip(answer.actuators, answer.coordinates[0], strict=True))
    drawn = forward(machine, commands).poses[0].pose
    off = []
    for pose, errors in ((drawn, truth), (wanted, 0.0 * truth)):
        columns = {f"pose.{path.removeprefix('pose.')}": np.array([value]) for path, value in pose.items()}
        model = error_model(machine, columns, 1, np.zeros(6))
        moved, _ = model.displacement(errors)
        turned = exponential(np.hstack([moved[:, :3], 0.0 * moved[:, :3]])).rotation @ model.drawn.axes
        turns = 0.0 * turned if name in ("delta", "orthoglide") else turned  # a Delta cannot turn back what errors turn
        off.append(np.concatenate([turns.ravel(), (model.drawn.tool + moved[:, 3:]).ravel()]))
    # A file says legs that are more than rods to first order: of errors of 2e-4 their square is left.
    assert off[0] == pytest.approx(off[1], abs=1e-9 if name in ("hexapod", "orthoglide") else 2e-7)
    uncorrected = command(built, given)
    assert np.abs(uncorrected.coordinates - answer.coordinates).max() > 1e-5


def test_a_fit_of_another_machine_is_refused(tmp_path):
    machine = load("hexapod")
    fitted(tmp_path, machine, truth_of(model_at_home(machine)))
    with pytest.raises(InputError, match="is the machine as drawn"):
        command(machine, fit=tmp_path)
    with pytest.raises(InputError, match="is the fit of 6-UPS hexapod"):
        command(load("delta"), fit=tmp_path)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6, 2e-4])
@pytest.mark.parametrize("name", ["hexapod", "hexapod-hardware", "tricept", "orthoglide", "zhang-gosselin-4dof"])
def test_a_machine_with_errors_of_any_size_is_a_file_that_can_be_read(name, size):
    """Also where no two axes of a joint meet, and where errors make rigid links yield by less than a file may say."""
    machine = load(name)
    errors = size * np.random.default_rng(1).standard_normal(len(model_at_home(machine).errors))
    text = built_text(machine, as_built(machine, errors).configuration, ())
    limits = build(text).tables["limits"]
    if name == "hexapod" and size > 1e-9:  # six legs of one length at its home pose
        leg = respond(machine).configuration.legs[0]
        drawn, length = machine.tables["limits"], (leg.path[-1] - leg.path[0]).norm()
        between = (drawn.shortest_leg - length, drawn.longest_leg - length)
        assert (limits.travel_from, limits.travel_to) == pytest.approx(between)
        assert "Left out, since axes of joints do not meet: limits.shortest_leg" in text
