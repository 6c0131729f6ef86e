"""A quantity has one name and one number: whatever two views of a machine show under one name is compared here.

All bundled machines carry a load and a mass, and have a tool point that is not P, so that no two quantities agree by
chance. Numbers in print are compared to their digits, the others to round-off.
"""

import html
import json
import math
import re

import numpy as np
import pytest

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.cli import main
from kinetostat.kinetostatics.quantities import QUANTITIES
from kinetostat.machine.loading import bundled, load
from kinetostat.spec.renamed import DEPRECATED_KEYS
from kinetostat.studies.analysis import analyze
from kinetostat.studio.panels.tables import indices_text

SAME = 1e-9
"""Relative difference of two results of one formula in two arithmetics, at poses of moderate condition."""
NOTHING = 1e-12
"""An entry that couples two components vanishes below this share of what its diagonal entries allow."""
MOST = 50
"""Conditions that one requirement may have."""

QUICK = ("hexapod", "planar-3rrr", "tripteron", "zhang-gosselin-4dof")
"""Machines that plain `pytest` asks; the others take long."""
each_machine = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.numbers) for name in bundled()]
)

ONLY_IN_MAPS = {
    "aspect",
    "frobenius_condition",
}
"""Quantities of every machine that `analyze` does not show, but maps and requirements do."""
SPOKEN = {
    **{f"C_{component}": f"compliance_{component}" for component in COMPONENTS},
    **{f"K_{component}": f"stiffness_{component}" for component in COMPONENTS},
    "least stiffness, force": "least_translational_stiffness",
    "least stiffness, moment": "least_rotational_stiffness",
    "condition of K": "stiffness_condition",
    "singularity margin": "singularity_margin",
    "moving mass": "mass",
    "first natural frequency": "frequency_1",
    "displacement under load": "displacement",
}
"""The quantity that each row of `compare` shows."""


def settings(name):
    planar = load(name).family.planar
    force, moment = ("[1, 2, 0]", "[0, 0, 0.2]") if planar else ("[1, 2, -3]", "[0.1, 0.2, 0.3]")
    offset = "[0.01, 0.02, 0]" if planar else "[0.01, 0.02, 0.03]"
    texts = f"load.force={force}", f"load.moment={moment}", f"tool.offset={offset}", "tool.mass=5 kg"
    return [word for text in texts for word in ("--set", text)]


def answer(capsys, *words):
    assert main([*words, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def of_analysis(data):
    """Every quantity that the JSON of `analyze` gives, by the name of the quantity."""
    names, numbers = data["components"], {}
    for matrix in ("compliance", "stiffness"):
        for i, row in enumerate(names):
            numbers[f"{matrix}_{row}"] = data[f"{matrix}_diagonal"][i]
            for j, column in enumerate(names[i + 1 :], i + 1) if data[matrix] else ():
                numbers[f"{matrix}_{row}_{column}"] = data[matrix][i][j]
    soft = {c: numbers[f"compliance_{c}"] for c in names}
    numbers |= {f"free_stiffness_{c}": 1.0 / size if size else math.inf for c, size in soft.items()}
    for word, block in (("translational", "translation"), ("rotational", "rotation")):
        numbers[f"least_{word}_stiffness"] = data["principal_stiffnesses"]["free"][block]["values"][0]
        numbers[f"greatest_{word}_stiffness"] = data["principal_stiffnesses"]["guided"][block]["values"][-1]
        assert data["softest"][block]["stiffness"] == pytest.approx(numbers[f"least_{word}_stiffness"], rel=SAME)
    numbers |= {"mass": data["moving_mass"], "singularity_margin": data["singularity_margin"]}
    for kind, turning in (("force", False), ("moment", True)):
        loads = [abs(s["load"]) for s in data["load"]["springs"] if s["actuated"] and s["turning"] is turning]
        numbers |= {f"actuator_{kind}": max(loads)} if loads else {}
    lengths = [drive["coordinate"] for drive in data["actuators"] if drive["meaning"] == "length of the leg"]
    return numbers | ({"longest_leg": max(lengths), "shortest_leg": min(lengths)} if lengths else {})


def agree(name, one, other, scale=0.0):
    one, other = (None if size is not None and math.isinf(size) else size for size in (one, other))  # as JSON has them
    assert (one is None) == (other is None), name
    assert one is None or math.isclose(one, other, rel_tol=SAME, abs_tol=NOTHING * scale), (name, one, other)


@each_machine
def test_analyze_path_requirements_and_compare_show_the_same_numbers(capsys, tmp_path, name):
    changes = settings(name)
    demands = [q for q, v in QUANTITIES.items() if not (v.needs or v.modal or v.loaded or v.driven)]
    demands = [q for q in demands if set(QUANTITIES[q].components) <= set(load(name).family.component_names)]
    bounds = [f'"{quantity} > -1e30"' for quantity in demands]  # in SI, and so wide that all are met, also by infinity
    parts = {"first": ", ".join(bounds[:MOST]), "second": ", ".join(bounds[MOST:] or bounds[:1])}
    demanded = [word for key, part in parts.items() for word in ("--set", f"requirements.{key}=[{part}]")]
    data = answer(capsys, "analyze", name, *changes, *demanded)
    numbers = of_analysis(data)
    coordinate, value = next(iter(data["pose"].items()))
    (tmp_path / "pose.csv").write_text(f"{coordinate}\n{value!r}\n")
    wanted = [word for quantity in numbers for word in ("--quantity", quantity)]
    along = answer(capsys, "path", name, str(tmp_path / "pose.csv"), *changes, *wanted)["variables"]
    of_infinite = {q for q in demands if data["stiffness"] is None and q.startswith("stiffness_")}  # a leg is rigid
    assert {*demands} - numbers.keys() - of_infinite <= ONLY_IN_MAPS
    for quantity, number in numbers.items():
        (other,), parts = along[quantity]["values"], QUANTITIES[quantity].components
        matrix = quantity.partition("_")[0]
        scale = math.sqrt(math.prod(numbers[f"{matrix}_{c}"] for c in parts)) if len(parts) == 2 else 0.0
        agree(quantity, number, other, scale)
        assert along[quantity]["units"] == QUANTITIES[quantity].unit
    for verdict in data["requirements"]:
        quantity = verdict["quantity"]
        if quantity in numbers and len(QUANTITIES[quantity].components) < 2:
            agree(quantity, verdict["worst"], numbers[quantity])
            assert verdict["unit"] == QUANTITIES[quantity].unit
    numbers["stiffness_condition"] = data["stiffness_condition"]
    numbers["frequency_1"] = answer(capsys, "modes", name, *changes)["modes"][0]["frequency"]
    if (
        main(["analyze", name, "--loaded", *changes, "--json"]) == 0
    ):  # cogiro does not rest under them: it has no such row
        rest = json.loads(capsys.readouterr().out)
        moved = zip(rest["components"], rest["displacement"], strict=True)
        numbers["displacement"] = math.hypot(*(value for part, value in moved if not part.startswith("r")))
    capsys.readouterr()
    for row in answer(capsys, "compare", name, f"{name}:tool.mass=6 kg", *changes)["rows"]:
        agree(row["name"], row["values"][0], numbers.get(SPOKEN[row["name"]]))
        unit = {"stiffness_condition": "1", "displacement": "m"}.get(SPOKEN[row["name"]])
        assert row["units"] == (unit or QUANTITIES[SPOKEN[row["name"]]].unit)


@each_machine
def test_print_shows_the_numbers_of_the_json(capsys, name):
    """First lines, tables and the panel of the studio: each with the words that stand before the number."""
    changes = settings(name)
    data, display = answer(capsys, "analyze", name, *changes), load(name).display
    numbers = of_analysis(data)
    assert main(["analyze", name, *changes]) == 0
    text = " ".join(capsys.readouterr().out.split())
    margin = display.number(data["singularity_margin"])
    legs, platform = data["leg_singularity_margin"], data["platform_singularity_margin"]
    assert data["singularity_margin"] == min(legs, platform)
    parts = f"legs {display.number(legs)}, platform {display.number(platform)}"
    assert f"Singularity margin {margin} (0 singular, 1 best): {parts}." in text
    for component in data["components"]:
        quantity = f"free_stiffness_{component}"
        free = display.number(numbers[quantity], QUANTITIES[quantity].unit, "rigid")
        assert f"{component[-1]} {free}" in text.partition("Softest")[0], quantity
    if data["stiffness"] is not None:
        assert f"{display.number(data['stiffness_condition'])} of K" in text
    assert f"Moving mass: {display.show(numbers['mass'], 'kg')}" in text
    assert data["load"]["components"] == data["components"]
    moves = zip(data["components"], data["load"]["deflection"], strict=True)
    moved = math.hypot(*(size for component, size in moves if not component.startswith("r")))
    assert f"moves {display.show_deflection(moved, 'm')}" in text
    panel = cells(indices_text(analyze(load(name, changes[1::2]))))
    assert panel["singularity margin (0 to 1)"] == margin
    condition = math.inf if data["stiffness"] is None else data["stiffness_condition"]
    assert panel["condition number of K"] == display.number(condition)
    assert panel["least singular value of the joints of a leg"] == display.number(
        data["mobility"]["leg_least_singular_value"]
    )


def cells(page):
    """The second cell of each row of tables in HTML, by the first."""
    rows = [
        re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row, re.DOTALL) for row in re.findall(r"<tr.*?</tr>", page, re.DOTALL)
    ]
    plain = [[html.unescape(re.sub(r"<[^>]+>", "", cell)).strip() for cell in row] for row in rows]
    return {row[0]: row[1] for row in plain if len(row) > 1}


@pytest.mark.parametrize("name", ["hexapod", "tripteron", "planar-3rrr"])
@pytest.mark.numbers
def test_a_key_of_json_has_one_number_in_all_answers_about_a_pose(capsys, name):
    """The free machine, the machine under load, its vibration, sensitivities and guidelines; old keys do not count."""
    changes = settings(name)
    if name != "tripteron":  # whose links are heavy, so that gravity would be a load
        changes += ["--set", "tool.inertia=[0.1, 0.2, 0.3, 0, 0, 0]"]
    commands = (["analyze"], ["analyze", "--loaded"], ["modes"], ["modes", "--loaded"], ["sensitivity"], ["guidelines"])
    seen, values = {}, of_analysis(answer(capsys, "analyze", name, *changes))
    for command, *options in commands:
        data = answer(capsys, command, name, *changes, *options)
        for key, value in data.items():
            if key in data.get(DEPRECATED_KEYS, {}) or not is_number(value):
                continue
            first, where = seen.setdefault(key, (value, [command, *options]))
            close = value == first or np.allclose(value, first, rtol=SAME, atol=NOTHING * np.max(np.abs(first)))
            assert close, (key, where, command, options)
        for quantity, index in data.get("indices", {}).items():
            agree(quantity, index["value"], values[quantity])
    assert {"compliance", "tangent_compliance", "moving_mass", "compliance_diagonal"} <= seen.keys()


def is_number(value):
    """Whether a value of JSON is a number, or rows of numbers."""
    if isinstance(value, list):
        return bool(value) and all(map(is_number, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


@pytest.mark.parametrize("name", ["hexapod", "planar-3rrr"])
def test_modes_and_the_loaded_machine_show_the_numbers_of_their_quantities(capsys, tmp_path, name):
    changes = settings(name)
    data = answer(capsys, "analyze", name, *changes, "--loaded")
    (tmp_path / "pose.csv").write_text("x\n" + repr(answer(capsys, "analyze", name)["pose"]["x"]) + "\n")
    groups = "displacement", "tangent_stiffness", "tangent_free_stiffness", "frequency", "loaded_frequency"
    wanted = [word for group in (*groups, "load_factor", "slack_springs") for word in ("--quantity", group)]
    along = answer(capsys, "path", name, str(tmp_path / "pose.csv"), *changes, *wanted)["variables"]
    shown = {quantity: entry["values"][0] for quantity, entry in along.items()}
    for i, component in enumerate(data["components"]):
        agree(f"displacement_{component}", shown[f"displacement_{component}"], data["displacement"][i])
        agree("tangent", shown[f"tangent_stiffness_{component}"], data["tangent_stiffness"][i][i])
        agree("tangent free", shown[f"tangent_free_stiffness_{component}"], 1.0 / data["tangent_compliance"][i][i])
    agree("load_factor", shown["load_factor"], data["load_factor"])
    agree("slack_springs", shown["slack_springs"], sum(spring["slack"] for spring in data["springs"]))
    for quantity, options in (("frequency", []), ("loaded_frequency", ["--loaded"])):
        modes = answer(capsys, "modes", name, *changes, *options)["modes"]
        assert modes
        for number, mode in enumerate(modes, 1):
            agree(quantity, shown[f"{quantity}_{number}"], mode["frequency"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hexapod", "planar-3rrr"])
def test_a_report_shows_the_numbers_of_analyze(capsys, tmp_path, name):
    changes = settings(name)
    page, left_out = tmp_path / "report.html", ("maps", "guidelines", "sensitivity", "validation")
    words = [word for part in left_out for word in ("--without", part)]
    assert main(["report", name, *changes, *words, "-o", str(page)]) == 0
    capsys.readouterr()
    text = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page.read_text())).split())
    data, display = answer(capsys, "analyze", name, *changes), load(name).display
    margin = f"Singularity margin {display.number(data['singularity_margin'])} (0 singular"
    assert text.count(margin) == 2
    assert f"{display.number(data['stiffness_condition'])} of K" in text
    assert f"Moving mass: {display.show(data['moving_mass'], 'kg')}" in text
