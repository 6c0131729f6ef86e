"""A tool coupled by its receptance moves as the same tool does that is a body of the machine, or a mass on a spring."""

import numpy as np
import pytest

from kinetostat import load, lobes, modes
from kinetostat.spec.errors import InputError
from kinetostat.studies.tool_receptance import read_tool

SETTINGS = ["tool.mass=12 kg", "tool.inertia=[0.05, 0.06, 0.08, 0, 0, 0]", "damping.per_stiffness=2e-5 s"]
SETTINGS += ["cutting.direction=[1, 0.3, 0.2]", "cutting.pressure=2000 N/mm**2"]
FREQUENCIES = np.linspace(60.0, 900.0, 1681)
NAMES = ("rx", "ry", "rz", "x", "y", "z")


def written(folder, parts, frequencies=FREQUENCIES):
    """A file with the entries of a receptance, by what moves and what is pushed [frequencies]."""
    heads, columns = ["frequency [Hz]"], [frequencies]
    for name, values in parts.items():
        heads += [f"{name} real", f"{name} imaginary"]
        columns += [np.real(values), np.imag(values)]
    file = folder / "tool.csv"
    lines = [",".join(heads), *(",".join(f"{value:.17g}" for value in row) for row in np.transpose(columns))]
    file.write_text("\n".join(lines), "utf-8")
    return file


def rigid_body(mass, inertia, centre, tip):
    """Entries of the receptance of a free rigid body whose flange is at the origin, from Newton and Euler."""
    squares = (2.0 * np.pi * FREQUENCIES) ** 2

    def lever(point):  # motion of a point by a small turn and shift of the centre
        x, y, z = np.subtract(point, centre)
        whole = np.eye(6)
        whole[3:, :3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        return whole

    inverse = np.diag([*(1.0 / np.array(inertia)), *[1.0 / mass] * 3])
    points = {"tip": lever(tip), "flange": lever([0.0, 0.0, 0.0])}
    pairs = [("tip", "tip"), ("tip", "flange"), ("flange", "flange")]
    return {
        f"{moved}.{NAMES[i]}/{pushed}.{NAMES[k]}": -(points[moved] @ inverse @ points[pushed].T)[i, k] / squares + 0j
        for moved, pushed in pairs
        for i in range(6)
        for k in range(6)
    }


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    """A file of a tool that is a rigid body, and the machine to whose platform the same body is fixed."""
    parts = rigid_body(3.0, [0.02, 0.03, 0.01], [0.01, -0.02, -0.06], [0.02, 0.01, -0.15])
    file = written(tmp_path_factory.mktemp("tool"), parts)
    fixed = ["tool.offset=[0.02, 0.01, -0.15]", "tool.payload=3 kg", "tool.payload_centre=[-0.01, -0.03, 0.09]"]
    return file, load("hexapod", [*SETTINGS, *fixed, "tool.payload_inertia=[0.02, 0.03, 0.01, 0, 0, 0]"])


def test_a_rigid_tool_moves_as_a_body_of_the_machine_does(body):
    file, fixed = body
    answer = modes(load("hexapod", SETTINGS), tool_receptance=file)
    frequencies = FREQUENCIES[::37].tolist()
    exact = modes(fixed).receptance(frequencies)
    np.testing.assert_allclose(answer.receptance(frequencies), exact, atol=1e-9 * np.abs(exact).max(axis=(0,)).min())
    free = modes(load("hexapod", SETTINGS)).receptance(frequencies)
    assert np.abs(free - exact).max() > 0.1 * np.abs(exact).max(), "the tool does change the machine"


def test_lobes_with_a_tool_are_those_of_the_machine_that_has_it(body):
    file, fixed = body
    speeds = {"lowest": "1500 1/min", "highest": "6000 1/min"}
    machine = load("hexapod", SETTINGS)
    for cutter in ({}, {"teeth": 4, "entry": "90 deg"}):
        answer, exact = lobes(machine, tool_receptance=file, **cutter, **speeds), lobes(fixed, **cutter, **speeds)
        assert answer.least == pytest.approx(exact.least, rel=1e-3)
        assert answer.frequency == pytest.approx(exact.frequency, rel=1e-3)
        np.testing.assert_allclose(answer.widths, exact.widths, rtol=0.01)
    assert modes(machine, tool_receptance=file).softest([1, 0.3, 0.2]).real == pytest.approx(
        modes(fixed).softest([1, 0.3, 0.2]).real, rel=1e-3
    )


def test_a_tip_on_a_spring_moves_along_two_axes_and_the_rest_is_the_machines(tmp_path):
    """Dynamic stiffnesses of a mass beside a spring in a row with the machine; the tool says nothing about z."""
    mass, stiffness = 0.8, 4e6 * (1.0 + 0.03j)
    squares = (2.0 * np.pi * FREQUENCIES) ** 2
    whole, bend = -1.0 / (mass * squares) + 0j, 1.0 / stiffness
    parts = {}
    for axis in "xy":
        parts |= {f"tip.{axis}/tip.{axis}": whole, f"flange.{axis}/tip.{axis}": whole}
        parts[f"flange.{axis}/flange.{axis}"] = whole + bend
    machine = load("hexapod", [*SETTINGS, "pose.x=2 cm", "pose.pitch=10 deg"])
    answer, alone = modes(machine, tool_receptance=written(tmp_path, parts)), modes(machine)
    frequencies = FREQUENCIES[::29]
    here, free = answer.receptance(frequencies.tolist()), alone.receptance(frequencies.tolist())
    plane = np.ix_(range(len(frequencies)), [3, 4], [3, 4])
    bent = np.linalg.inv(free[plane] + bend * np.eye(2))
    exact = np.linalg.inv(bent - mass * ((2.0 * np.pi * frequencies) ** 2)[:, None, None] * np.eye(2))
    np.testing.assert_allclose(here[plane], exact, rtol=1e-9)
    # Along z the force meets the machine, whose flange carries the tool: the mass on its spring as a dynamic stiffness.
    carried = 1.0 / (bend + whole[::29])
    stiff = np.linalg.inv(free)
    stiff[:, 3, 3] += carried
    stiff[:, 4, 4] += carried
    np.testing.assert_allclose(here[:, 5, 5], np.linalg.inv(stiff)[:, 5, 5], rtol=1e-8)
    np.testing.assert_allclose(here, np.swapaxes(here, 1, 2), atol=1e-9 * np.abs(here).max())


def test_units_stand_in_brackets_and_beyond_its_frequencies_nothing_is_said(tmp_path):
    file = tmp_path / "tool.csv"
    heads = "frequency [kHz],tip.x/tip.x real [um/N],tip.x/tip.x imaginary [um/N],tip.x/flange.x real,"
    heads += "tip.x/flange.x imaginary,flange.x/flange.x real [mm/N],flange.x/flange.x imaginary [mm/N]"
    file.write_text(heads + "\n0.1,-2,-0.1,-1e-6,0,-3e-3,0\n0.4,-1,-0.1,-1e-6,0,-1e-3,0\n", "utf-8")
    tool = read_tool(file)
    np.testing.assert_allclose(tool.frequencies, [100.0, 400.0])
    assert tool.tip_tip[0, 0, 0] == pytest.approx(-2e-6 - 1e-7j)
    assert tool.flange_flange[1, 0, 0] == pytest.approx(-1e-6)
    answer = modes(load("hexapod", SETTINGS), tool_receptance=file)
    answer.receptance([100.0, 250.0, 400.0])
    with pytest.raises(InputError, match="100 to 400 Hz"):
        answer.receptance([99.0])


MASS = {"tip.x/tip.x": np.full(3, -1e-6 + 0j), "tip.x/flange.x": np.full(3, -1e-6 + 0j)}
WHOLE = MASS | {"flange.x/flange.x": np.full(3, -1e-6 + 0j)}


@pytest.mark.parametrize(
    ("parts", "frequencies", "says"),
    [
        (MASS, [1, 2, 3], r"flange\.x/flange\.x is missing"),
        ({"flange.x/flange.x": WHOLE["flange.x/flange.x"]}, [1, 2, 3], "about the tip"),
        (WHOLE | {"tip.y/tip.y": np.full(3, -1e-6 + 0j)}, [1, 2, 3], r"add tip\.y/flange\.y"),
        (WHOLE, [1, 3, 2], "line 4: frequencies must rise"),
        (WHOLE, [0, 1, 2], "line 2: frequencies must rise"),
        ({name: value + 1e-9j for name, value in WHOLE.items()}, [1, 2, 3], "change the sign"),
        (WHOLE | {"tip.q/tip.x": np.zeros(3)}, [1, 2, 3], r"tip\.q/tip\.x real.* is not a column"),
        (WHOLE | {"tip.x / tip.x": WHOLE["tip.x/tip.x"]}, [1, 2, 3], r"tip\.x/tip\.x has two columns real; keep one"),
    ],
)
def test_a_file_with_a_mistake_is_refused(tmp_path, parts, frequencies, says):
    with pytest.raises(InputError, match=says):
        read_tool(written(tmp_path, parts, np.array(frequencies, dtype=float)))


def test_a_missing_imaginary_part_and_a_missing_frequency_are_named(tmp_path):
    file = tmp_path / "tool.csv"
    file.write_text("frequency [Hz],tip.x/tip.x real\n1,2\n2,2\n", "utf-8")
    with pytest.raises(InputError, match="no column imaginary"):
        read_tool(file)
    file.write_text("tip.x/tip.x real,tip.x/tip.x imaginary\n1,2\n2,2\n", "utf-8")
    with pytest.raises(InputError, match="column frequency"):
        read_tool(file)
