"""The machine as C: its functions against the engine and against Python pose by pose, compiled without a warning."""

import ctypes
import math
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares

from kinetostat import build, export, load
from kinetostat.engine.batch import evaluate
from kinetostat.engine.derivatives import evaluate_gradient
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.forward import stand
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.quantities import ENTRIES
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import bundled
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.commanding import actuator_targets
from kinetostat.studies.under_load import under_load
from machines import hangprinter
from printed_machines import MACHINES, entries_by_python, machine_of, poses_of, printable, worst_difference

WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
QUICKLY = "-O0"
"""Formulas have hundreds of thousands of characters, and compile eight times as fast without optimisation."""
COMPILER = next((name for name in ("clang", "gcc") if shutil.which(name)), "cc")
"""The C compiler of this machine, where one will do: clang takes half of the time of gcc without optimisation."""
CHECKS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
LOADED = ["load.force=[2, -3, -10]"]
NUMBERS = np.ctypeslib.ndpointer(dtype=float, flags="C_CONTIGUOUS")


class Functions:
    """The functions of an exported machine as a library of this process."""

    def __init__(self, machine, folder, inputs=None, outputs=None):
        self.source = export(machine, folder / "pkm.c", inputs=inputs, outputs=outputs)[0]
        library = folder / "pkm.so"
        command = [COMPILER, *WARNINGS, QUICKLY, "-shared", "-fPIC", str(self.source), "-o", str(library), "-lm"]
        subprocess.run(command, check=True, capture_output=True, text=True)
        self._library = ctypes.CDLL(str(library))

    def at(self, name, poses, *sizes):
        """Call a function at poses [n x inputs]: its codes [n] and each of its results [n x size]."""
        function = getattr(self._library, f"pkm_{name}")
        function.argtypes, function.restype = [NUMBERS] * (1 + len(sizes)), ctypes.c_int
        results = [np.empty((len(poses), size)) for size in sizes]
        codes = [function(pose, *(result[k] for result in results)) for k, pose in enumerate(poses)]
        return np.array(codes), *results


@pytest.fixture(scope="module")
def functions_of(tmp_path_factory):
    """The functions of a machine, which several tests call."""
    return cache(lambda label: Functions(machine_of(label), tmp_path_factory.mktemp("printed")))


@pytest.mark.parametrize("label", MACHINES)
def test_c_and_compiled_functions_give_what_plain_python_gives(label, functions_of):
    """K and C at 1000 poses: statuses are equal, entries within a share of the diagonal in their row and column."""
    machine, functions = machine_of(label), functions_of(label)
    poses, points = poses_of(machine, 1000, 0.3)
    statuses, expected = entries_by_python(machine, points)
    ok = statuses == Status.OK
    assert ok.sum() > 20
    compiled = evaluate(machine, points, ENTRIES, repeated=True)
    codes, stiffness, compliance = functions.at("matrices", poses, 36, 36)
    upper = [6 * i + j for i in range(6) for j in range(i, 6)]
    entries = np.concatenate([compliance[:, upper], stiffness[:, upper]], axis=1)
    for found, rows in ((compiled.status, np.stack([compiled.values[e] for e in ENTRIES], axis=1)), (codes, entries)):
        assert np.array_equal(found, statuses)
        assert worst_difference(rows[ok], expected[ok]) < 1e-12
    assert np.isnan(entries[~ok]).all()
    for matrix in (stiffness, compliance):
        assert np.array_equal(matrix, matrix.reshape(-1, 6, 6).swapaxes(1, 2).reshape(-1, 36), equal_nan=True)


@pytest.mark.parametrize("name", printable())
def test_actuators_stand_where_python_says_and_slopes_are_those_of_differences(name, functions_of):
    machine, functions = load(name), functions_of(name)
    poses, points = poses_of(machine, 25, 0.05)
    count = len(stand(machine))
    codes, coordinates, slopes = functions.at("actuators", poses, count, count * poses.shape[1])
    assert (codes == Status.OK).any()
    for pose, code, found, slope in zip(poses, codes, coordinates, slopes, strict=True):
        there = with_values(machine, dict(zip(points.paths, pose.tolist(), strict=True)))
        expected = np.array([float(a.coordinate) for a in stand(there)])
        if code != Status.OK:
            assert np.isnan(found).all()
            continue
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-13)
        step = 1e-6
        for j, column in enumerate(slope.reshape(count, -1).T):
            beside = np.stack([pose, pose])
            beside[:, j] += [-step, step]
            _, both, _ = functions.at("actuators", beside, count, count * poses.shape[1])
            difference = np.arctan2(np.sin(both[1] - both[0]), np.cos(both[1] - both[0])) / (2.0 * step)
            assert column == pytest.approx(difference, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", ["hexapod", "delta", "tricept", "hexapod-hardware"])
def test_a_pose_comes_back_from_its_actuators(name, functions_of):
    machine, functions = load(name), functions_of(name)
    poses, _ = poses_of(machine, 200, 0.1)
    size = poses.shape[1]
    codes, coordinates, _ = functions.at("actuators", poses, size, size * size)
    ok = codes == Status.OK
    assert ok.sum() > 100
    back = np.tile(poses_of(machine, 1, 0.0)[0], (len(poses), 1))
    forward = functions._library.pkm_forward
    forward.argtypes, forward.restype = [NUMBERS, NUMBERS], ctypes.c_int
    ends = np.array([forward(wanted, start) for wanted, start in zip(coordinates, back, strict=True)])
    assert (ends[ok] == Status.OK).all()
    assert np.abs(back - poses)[ok].max() < 1e-12
    assert (ends[~ok] != Status.OK).all()


def test_coordinates_that_no_pose_has_are_refused(functions_of):
    functions = functions_of("hexapod")
    forward = functions._library.pkm_forward
    forward.argtypes, forward.restype = [NUMBERS, NUMBERS], ctypes.c_int
    start = poses_of(load("hexapod"), 1, 0.0)[0][0]
    assert forward(np.array([0.1, 9.0, 0.1, 9.0, 0.1, 9.0]), start) != Status.OK
    assert forward(np.full(6, math.nan), start) != Status.OK


@pytest.mark.parametrize("name", ["hexapod", "hexapod-cubic", "tricept", "delta", "tripteron", "hexapod-rus"])
def test_rest_and_command_are_those_of_the_solver_for_any_machine(name, tmp_path):
    machine = load(name, LOADED)
    functions = Functions(machine, tmp_path)
    poses, points = poses_of(machine, 20, 0.03)
    codes, displacement = functions.at("rest", poses, 6)
    names = [f"displacement_{part}" for part in ("rx", "ry", "rz", "x", "y", "z")]
    found = evaluate(machine, points, names)
    assert np.array_equal(codes, found.status)
    ok = codes == Status.OK
    assert ok.sum() > 10
    expected = np.stack([found.values[each] for each in names], axis=1)
    for part in (slice(3), slice(3, 6)):  # turns, then displacements
        largest = np.abs(expected[ok, part]).max()
        assert np.abs(displacement[ok, part] - expected[ok, part]).max() < 1e-12 * largest
    targets = actuator_targets(machine, points.columns(0, len(poses)), len(poses))
    ends, coordinates = functions.at("command", poses, targets.coordinates.shape[1])
    assert (ends[ok] == Status.OK).all()
    # The stiffness of the Delta's bars depends on the pose, which C takes where the loaded machine is commanded to.
    second_order = np.nanmax(targets.corrections**2) if name == "delta" else 0.0
    assert coordinates[ok] == pytest.approx(targets.coordinates[ok], rel=1e-12, abs=1e-13 + second_order)


def test_quantities_and_their_derivatives_are_those_of_the_engine(tmp_path):
    """Of the free machine, under load, and natural frequencies, by the pose and by chosen parameters."""
    machine = load("hexapod", [*LOADED, "tool.mass=4 kg", "tool.inertia=[0.02, 0.02, 0.03, 0, 0, 0]"])
    wanted = [
        "compliance_x",
        "stiffness_rz",
        "frequency_1",
        "loaded_frequency_2",
        "displacement_z",
        "tangent_stiffness_z",
    ]
    inputs = ["load.force.0", "tool.offset.2", "stiffness.actuator.3"]
    functions = Functions(machine, tmp_path, inputs, wanted)
    poses, points = poses_of(machine, 12, 0.03)
    chosen = [float(values(machine)[name]) for name in inputs]
    rows = np.ascontiguousarray(np.hstack([poses, np.tile(chosen, (len(poses), 1))]))
    paths = [*points.paths, *inputs]
    codes, found, slopes = functions.at("quantities", rows, len(wanted), len(wanted) * len(paths))
    assert (codes == Status.OK).all()
    table = PointTable(dict(zip(paths, np.ascontiguousarray(rows.T), strict=True)))
    expected = evaluate_gradient(machine, table, wanted, paths)
    assert found == pytest.approx(expected.values.T, rel=1e-9)
    sloped, exact = slopes.reshape(len(rows), len(wanted), len(paths)), np.moveaxis(expected.gradients, 2, 0)
    known = np.isfinite(exact)
    assert known.all()
    assert np.array_equal(known, np.isfinite(sloped))
    scale = np.abs(np.where(known, exact, 0.0)).max(axis=(0, 2))[None, :, None]
    assert np.allclose(
        np.where(known, sloped, 0.0) / scale.clip(1e-300), np.where(known, exact, 0.0) / scale.clip(1e-300), atol=1e-9
    )


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        (
            "planar-3rrr",
            ["linear_density.proximal_links=1", "linear_density.distal_links=0.5", "load.force=[200, -300, 0]"],
        ),
        ("delta", ["linear_density.arms=1", "linear_density.bars=0.3", "load.force=[20, -30, -100]"]),
        ("tripteron", ["load.force=[20, -30, -100]"]),
        ("hexapod-rus", ["linear_density.rods=2", "load.force=[20, -30, -3000]"]),  # rods spin
    ],
)
def test_massive_legs_that_close_loops_have_frequencies_and_load_factors(name, settings, tmp_path):
    """By Jacobi's rotations in C; the solver for any machine has coordinates of its own and LAPACK."""
    machine = load(name, ["tool.mass=2 kg", *settings])
    wanted = ["frequency_1", "frequency_2", "loaded_frequency_1", "load_factor"]
    functions = Functions(machine, tmp_path, None, wanted)
    (header,) = tmp_path.rglob("*.h")
    assert re.search(r"At most \d{6,} before them, for the states and modes", header.read_text("utf-8"))
    poses, points = poses_of(machine, 6, 0.03)
    size = poses.shape[1]
    codes, found, slopes = functions.at("quantities", poses, len(wanted), len(wanted) * size)
    expected = evaluate(machine, points, wanted)
    assert np.array_equal(codes, expected.status)
    assert not codes.any()
    assert found == pytest.approx(np.stack([expected.values[each] for each in wanted], axis=1), rel=1e-9)
    exact = evaluate_gradient(machine, points, wanted, points.paths).gradients
    sloped = np.moveaxis(slopes.reshape(len(poses), len(wanted), size), 0, 2)
    assert np.abs(sloped - exact).max(axis=(1, 2)) / np.abs(exact).max(axis=(1, 2)) == pytest.approx(0.0, abs=1e-9)
    step = 1e-6
    beside = {path: np.repeat(row[:1], 2) for path, row in points.columns(0, len(poses)).items()}
    beside[points.paths[0]] = beside[points.paths[0]] + np.array([-step, step])
    ends = evaluate(machine, PointTable(beside), wanted)
    for k, each in enumerate(wanted):
        difference = np.diff(ends.values[each])[0] / (2.0 * step)
        assert exact[k, 0, 0] == pytest.approx(difference, rel=1e-5, abs=1e-6 * np.abs(exact[k]).max())


@pytest.fixture(scope="module", params=["gcc", "clang"])
def compiler(request):
    """A C compiler of this machine."""
    if not shutil.which(request.param):
        pytest.skip(f"{request.param} is not installed")
    return request.param


@pytest.fixture(scope="module")
def checking_compiler(compiler, tmp_path_factory):
    """A C compiler that can link its sanitizers, whose library is a package of its own for some."""
    source = tmp_path_factory.mktemp("checks") / "empty.c"
    source.write_text("int main(void) { return 0; }\n")
    command = [compiler, *CHECKS, str(source), "-o", str(source.with_suffix(""))]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip(f"the library of {compiler}'s sanitizers is not installed")
    return compiler


def _run_written_test(files, compiler, options):
    """Compile the test that an export has written, and run it."""
    source, _, test, _ = map(str, files)
    program = f"{source}.checked"
    command = [compiler, *WARNINGS, *options, test, source, "-o", program, "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    ran = subprocess.run([program], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "0 differences" in ran.stdout


@pytest.fixture(
    scope="module",
    params=[
        ("hexapod", LOADED, "compliance_x,displacement_z"),
        ("hexapod-hardware", [], "stiffness_z"),
        ("planar-3rrr", [], "singularity_margin"),
        ("zhang-gosselin-4dof", LOADED, "compliance_rx,frequency_1"),
        ("hexapod", ["stiffness.actuator=rigid"], "stiffness_z"),
    ],
    ids=lambda row: " ".join([row[0], *row[1]]),
)
def written(request, tmp_path_factory):
    """The files of an exported machine."""
    name, settings, outputs = request.param
    place = tmp_path_factory.mktemp("written") / "a.machine-1.c"
    files = export(load(name, settings), place, outputs=outputs.split(","))
    assert files[1].name == "a.machine-1.h"
    return files


@pytest.mark.parametrize(
    "options", [["-O2", "-pedantic"], [QUICKLY, "-DA_MACHINE_1_REAL=float"]], ids=["double", "float"]
)
def test_the_written_test_passes_without_a_warning(compiler, written, options):
    _run_written_test(written, compiler, options)


@pytest.mark.parametrize("options", [[], ["-DA_MACHINE_1_REAL=float"]], ids=["double", "float"])
def test_the_written_test_passes_under_sanitizers(checking_compiler, written, options):
    _run_written_test(written, checking_compiler, [QUICKLY, *CHECKS, *options])


def test_the_written_test_fails_where_a_number_is_wrong(tmp_path):
    files = export(load("planar-3rpr"), tmp_path / "pkm.c")
    source = files[0].read_text()
    assert source.count("0.5") > 2
    files[0].write_text(source.replace("0.5", "0.5001", 1))
    command = ["make", "-s", "-f", "pkm.mk", "test"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, check=False).returncode != 0


@pytest.mark.parametrize(
    ("name", "inputs", "outputs", "says"),
    [
        ("passive-leg-3dof-pu", ["tool.ofset.2"], None, "--inputs"),
        ("hexapod", None, ["stifness_z"], "--outputs"),
        ("hexapod", None, ["displacement_z"], "nothing loads it"),
    ],
)
def test_what_has_no_program_is_refused_in_a_sentence(name, inputs, outputs, says, tmp_path):
    with pytest.raises(InputError, match=says):
        export(load(name), tmp_path / "pkm.c", inputs=inputs, outputs=outputs)
    assert not list(tmp_path.iterdir())


def test_a_leg_without_a_closed_form_is_refused(tmp_path):
    with pytest.raises(InputError, match="no closed form"):
        export(load("tests/cases/seven-joint-arm.toml"), tmp_path / "pkm.c")


def test_a_name_that_make_cannot_take_is_refused(tmp_path):
    with pytest.raises(InputError, match="letters"):
        export(load("hexapod"), tmp_path / "my machine.c")


def test_names_in_a_file_are_never_code(tmp_path):
    """A joint's name that would end a comment, and begin a program."""
    text = bundled()["tripteron"].replace('name = "slide"', 'name = "a */ int x; /* b"')
    text = text.replace('name      = "slide"', 'name = "a */ int x; /* b"')
    machine = replace(build(text), name="b */ int y; /* c ??/")
    source, header, *_ = export(machine, tmp_path / "pkm.c")
    for file in (source, header):
        words = file.read_text()
        assert words.count("/*") == words.count("*/")
        assert "int x;" not in re.sub(r"/\*.*?\*/", "", words, flags=re.DOTALL)
        assert "int y;" not in re.sub(r"/\*.*?\*/", "", words, flags=re.DOTALL)
    subprocess.run([COMPILER, *WARNINGS, "-c", str(source), "-o", str(tmp_path / "pkm.o")], check=True)


def test_a_hanging_printer_stands_where_it_should_after_the_exported_command(tmp_path):
    """Its cables are commanded by C; where the loaded model then comes to rest is found by SciPy and the solver."""
    machine = hangprinter()
    functions = Functions(machine, tmp_path)
    names = [path for path in values(machine) if path.startswith("pose.")]
    drawn = np.random.default_rng(4).uniform(-1.0, 1.0, (4, 6))
    poses = np.ascontiguousarray(drawn * [0.5, 0.5, 0.4, 0.0, 0.0, 0.0] + [0.0, 0.0, 0.4, 0.0, 0.0, 0.0])
    codes, coordinates = functions.at("command", poses, 9)
    assert not codes.any()

    def at(pose):
        return with_values(machine, dict(zip(names, map(float, pose), strict=True)))

    def place(loaded):
        state = under_load(loaded)
        return np.array(respond(loaded).reference.components()) + state.displacement[3:]

    for pose, commanded in zip(poses, coordinates, strict=True):
        wanted = np.array(respond(at(pose)).reference.components())
        before = np.linalg.norm(place(at(pose)) - wanted)
        assert before > 3e-4, "m"
        found = least_squares(
            lambda p, goal=commanded: [float(a.coordinate) - c for a, c in zip(stand(at(p)), goal, strict=True)],
            pose, xtol=1e-15, ftol=1e-15, gtol=1e-15,
        )  # fmt: skip
        assert np.abs(found.fun).max() < 1e-12, "the cables are as long as at one pose"
        assert np.linalg.norm(place(at(found.x)) - wanted) < 1e-6 * before
