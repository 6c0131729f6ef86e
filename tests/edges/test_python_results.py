"""Results as Python takes them: arrays, tables of pandas, shares by name; other numbers, families."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from kinetostat import Machine, analyze, build, compare, load, register, sensitivity
from kinetostat.machine.catalogue import families
from kinetostat.machine.loading import as_toml
from refusals import refused

HEXAPOD = load("hexapod")


def test_matrices_are_arrays_that_refuse_assignments():
    analysis = analyze(HEXAPOD)
    assert analysis.K.shape == (6, 6)
    assert analysis.K.tolist() == analysis.stiffness.tolist()
    assert analysis.C.tolist() == analysis.compliance.tolist()
    np.testing.assert_allclose(analysis.K @ analysis.C, np.eye(6), atol=1e-9)
    with pytest.raises(TypeError, match="belongs to an answer and cannot be changed"):
        analysis.C[0, 0] = 1.0


def test_a_matrix_without_a_finite_value_says_why():
    with refused(r"K has no finite value at this pose. .*would have to span"):
        analyze(load("delta", ["pose.z=-30 m"])).K  # noqa: B018
    assert analyze(load("zhang-gosselin-4dof", ["stiffness.passive_links=rigid"])).C.shape == (6, 6)


def test_shares_are_looked_up_by_name():
    analysis = analyze(load("zhang-gosselin-4dof"))
    shares = analysis.shares_of("x")
    assert math.isclose(sum(shares.values()), 1.0)
    assert list(shares.values()) == sorted(shares.values(), reverse=True)
    assert set(shares) == {spring.part for spring in analysis.attribution}
    assert analysis.shares_of("x", "K") != shares
    with refused('component is "w"; choose from rx, ry'):
        analysis.shares_of("w")
    with refused('matrix is "S"'):
        analysis.shares_of("x", "S")


def test_results_are_tables_of_pandas():
    analysis = analyze(load("zhang-gosselin-4dof"))
    assert analysis.to_pandas("C").loc["rx", "x"] == analysis.compliance[0][3]
    attribution = analysis.to_pandas()
    assert attribution.filter(like="C_").sum().to_numpy() == pytest.approx(np.ones(6))
    assert attribution.groupby("part")["K_z"].sum().to_dict() == pytest.approx(analysis.shares_of("z", "K"))
    influences = sensitivity(HEXAPOD, "stiffness_z").to_pandas()
    assert influences.loc["z", "stiffness_z derivative"] > 0
    both = compare({"one": HEXAPOD, "two": HEXAPOD.with_values(z="16 cm")}).to_pandas()
    assert list(both.columns) == ["unit", "one", "two"]


def test_other_numbers_are_given_by_any_name_one_by_one_or_as_arrays():
    angles = np.radians([10, 50, 130, 170, 250, 290])
    machine = HEXAPOD.with_values({"geometry.base_angles": angles, "pose.z": 0.16}, x="5 mm", base_radius=0.13)
    assert machine.tables["geometry"].base_angles == tuple(angles)
    assert (machine.tables["pose"].z, machine.tables["pose"].x) == (0.16, 0.005)
    assert HEXAPOD.with_values(actuator=[1e7] * 6) == HEXAPOD.with_values(actuator="10 N/um")
    assert HEXAPOD.with_values(geometry_base_angles_1=0.5).tables["geometry"].base_angles[1] == 0.5
    assert machine.family is HEXAPOD.family


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"geometry.base_angles": [1, 2]}, r"geometry\.base_angles is \[1, 2\]; give 6 values"),
        ({"x": [1, 2]}, r"x is \[1, 2\]; give one value"),
        ({"x": None}, r"values\['x'\] is None"),
        ({"x": True}, r"values\['x'\] is True"),
        ({"x": float("nan")}, r"x is nan: it is not a finite number"),
        ({"geometry.base_angles": ["1 mm"] * 6}, r'geometry\.base_angles\.0 is "1 mm": "mm" is not a unit of angle'),
        ({"base_angles": 1}, r"geometry\.base_angles holds 6 numbers; name one of them"),
    ],
)
def test_a_number_that_cannot_be_is_refused_by_its_name(values, message):
    with refused(message):
        HEXAPOD.with_values(values)


def test_a_family_is_registered_without_editing_the_package(monkeypatch):
    monkeypatch.setattr("kinetostat.machine.catalogue._REGISTERED", {})
    mine = register(replace(HEXAPOD.family, name="my-hexapod", summary="mine"))
    assert families()["my-hexapod"] is mine
    text = as_toml(HEXAPOD).replace('family = "hexapod"', 'family = "my-hexapod"')
    machine = build(text)
    assert isinstance(machine, Machine)
    assert analyze(machine).stiffness.tolist() == analyze(HEXAPOD).stiffness.tolist()
    assert build(as_toml(machine)).family is mine
    with refused('family "hexapod" belongs to kinetostat'):
        register(HEXAPOD.family)
    with refused('family is "hexapod"; give a Family'):
        register("hexapod")


def test_an_analysis_in_python_loads_no_pandas():
    code = (
        "import sys; from kinetostat import analyze, load; analyze(load('hexapod')).K; print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
