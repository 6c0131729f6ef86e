"""The C functions inside of other programs: LinuxCNC's kinematics, MATLAB's function and a model of FMI 3."""

import ctypes
import re
import subprocess
import zipfile
from dataclasses import replace

import fmpy
import fmpy.validation
import numpy as np
import pytest

from kinetostat import export, load
from kinetostat.engine.batch import evaluate
from kinetostat.engine.points import PointTable
from kinetostat.kinematics.forward import stand
from kinetostat.machine.parameters import values, with_values
from kinetostat.spec.errors import InputError
from kinetostat.studies.analysis import analyze
from kinetostat.studies.commanding import actuator_targets

WARNINGS = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC"]
LOADED = ["load.force=[20, -30, -100]"]

KINEMATICS_H = """
#include <math.h>
typedef struct { double x, y, z; } PmCartesian;
typedef struct EmcPose { PmCartesian tran; double a, b, c, u, v, w; } EmcPose;
typedef enum {
    KINEMATICS_IDENTITY = 1, KINEMATICS_FORWARD_ONLY, KINEMATICS_INVERSE_ONLY, KINEMATICS_BOTH
} KINEMATICS_TYPE;
typedef unsigned long int KINEMATICS_FORWARD_FLAGS;
typedef unsigned long int KINEMATICS_INVERSE_FLAGS;
#define EXPORT_SYMBOL(name) extern int exported_##name
#define KINS_NOT_SWITCHABLE
"""
"""The part of LinuxCNC's headers that a kinematics component uses."""

MEX_H = """
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
typedef size_t mwSize;
typedef struct { size_t shape[3]; double *numbers; const char *text; } mxArray;
enum { mxDOUBLE_CLASS, mxREAL };
char refusal[200];
static jmp_buf refused;
static bool mxIsDouble(const mxArray *a) { return a->numbers != NULL; }
static bool mxIsComplex(const mxArray *a) { (void)a; return false; }
static size_t mxGetM(const mxArray *a) { return a->shape[0]; }
static size_t mxGetN(const mxArray *a) { return a->shape[1]; }
static double *mxGetPr(const mxArray *a) { return a->numbers; }
static int mxGetString(const mxArray *a, char *text, size_t size)
{
    if (a->text) { strncpy(text, a->text, size - 1); }
    return !a->text;
}
static mxArray *mxCreateNumericArray(size_t n, const mwSize *shape, int kind, int complexity)
{
    mxArray *a = calloc(1, sizeof *a);
    (void)n, (void)kind, (void)complexity;
    memcpy(a->shape, shape, sizeof a->shape);
    a->numbers = calloc(shape[0] * shape[1] * shape[2] + 1, sizeof(double));
    return a;
}
static mxArray *mxCreateDoubleMatrix(size_t rows, size_t columns, int complexity)
{
    const mwSize shape[3] = {rows, columns, 1};
    return mxCreateNumericArray(3, shape, mxDOUBLE_CLASS, complexity);
}
static void mxDestroyArray(mxArray *a) { free(a->numbers); free(a); }
static void mexErrMsgIdAndTxt(const char *id, const char *form, ...)
{
    va_list list;
    (void)id;
    va_start(list, form);
    vsnprintf(refusal, sizeof refusal, form, list);
    va_end(list);
    longjmp(refused, 1);
}
void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[]);
int call(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[])
{
    if (setjmp(refused)) { return 0; }
    mexFunction(nlhs, plhs, nrhs, prhs);
    return 1;
}
"""
"""The part of mex.h that the function uses, and a call of it that survives a refusal."""


def compiled(folder, sources, name="program"):
    library = folder / f"{name}.so"
    command = ["cc", *WARNINGS, "-I", str(folder), *map(str, sources), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return ctypes.CDLL(str(library))


class EmcPose(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("x", "y", "z", "a", "b", "c", "u", "v", "w")]


def linuxcnc(machine, folder):
    """A component as halcompile would make a program of it: declarations before `;;`, C behind."""
    path = export(machine, folder / "pkmkins.comp", to="linuxcnc")[0]
    declarations, code = path.read_text("ascii").split("\n;;\n")
    options = re.findall(r"^modparam int (\w+) = (\d+)", declarations, re.MULTILINE)
    pins = re.findall(r"^pin out s32 (\w+)", declarations, re.MULTILINE)
    assert re.search(r"^component pkmkins ", declarations, re.MULTILINE)
    head = [*(f"int {name} = {value};" for name, value in options), *(f"int {name};" for name in pins)]
    head.append("#define FUNCTION(name) void name(void)\nFUNCTION(report);")
    (folder / "kinematics.h").write_text(KINEMATICS_H)
    (folder / "rtapi_math.h").write_text("#include <math.h>\n")
    (folder / "pkmkins.c").write_text("\n".join([*head, code]))
    return compiled(folder, [folder / "pkmkins.c"])


@pytest.mark.parametrize("name", ["hexapod", "delta", "planar-3rrr", "tricept", "zhang-gosselin-4dof"])
def test_linuxcnc_joints_are_those_of_python_and_lead_back_to_the_axes(name, tmp_path):
    machine = load(name)
    library = linuxcnc(machine, tmp_path)
    assert library.kinematicsType() == 4
    units = [1000.0 if actuator.slides else 180.0 / np.pi for actuator in stand(machine)]
    expected = [float(actuator.coordinate) * unit for actuator, unit in zip(stand(machine), units, strict=True)]
    places = {path.removeprefix("pose."): value for path, value in values(machine).items() if path.startswith("pose.")}
    lengths = {"x": "x", "y": "y", "z": "z", "length": "z"}
    letters = {"roll": "a", "pitch": "b", "yaw": "c", "angle": "c", "theta1": "a", "theta2": "b"}
    letters |= {"theta5": "a", "theta6": "b"}
    world = EmcPose()
    for word, value in places.items():
        unit = 1000.0 if word in lengths else 180.0 / np.pi
        setattr(world, lengths.get(word) or letters[word], float(value) * unit)
    joints = (ctypes.c_double * 16)()
    assert library.kinematicsInverse(ctypes.byref(world), joints, None, None) == 0
    assert joints[: len(expected)] == pytest.approx(expected, rel=1e-12, abs=1e-9)
    near = EmcPose(*(getattr(world, field) for field, _ in EmcPose._fields_))
    for word in places:
        field = lengths.get(word) or letters[word]
        setattr(near, field, getattr(near, field) + 0.1)
    assert library.kinematicsForward(joints, ctypes.byref(near), None, None) == 0
    assert [near.x, near.y, near.z, near.a, near.b, near.c] == pytest.approx(
        [world.x, world.y, world.z, world.a, world.b, world.c], abs=1e-8
    )


def test_linuxcnc_compensates_for_loads_both_ways(tmp_path):
    machine = load("hexapod", LOADED)
    library = linuxcnc(machine, tmp_path)
    pose = {path: float(v) for path, v in values(machine).items() if path.startswith("pose.")}
    columns = {path: np.array([value]) for path, value in pose.items()}
    expected = 1e3 * actuator_targets(machine, columns, 1).coordinates[0]
    world, joints = EmcPose(z=1e3 * pose["pose.z"]), (ctypes.c_double * 16)()
    assert library.kinematicsInverse(ctypes.byref(world), joints, None, None) == 0
    assert max(abs(np.array(joints[:6]) - expected)) > 1e-4, "without compensation"
    ctypes.c_int.in_dll(library, "compensate").value = 1
    assert library.kinematicsInverse(ctypes.byref(world), joints, None, None) == 0
    assert joints[:6] == pytest.approx(expected, rel=1e-12)
    near = EmcPose(x=0.5, z=world.z + 1.0)
    assert library.kinematicsForward(joints, ctypes.byref(near), None, None) == 0
    assert [near.x, near.y, near.z, near.a, near.b, near.c] == pytest.approx([0, 0, world.z, 0, 0, 0], abs=1e-9)


def test_linuxcnc_refuses_a_pose_out_of_reach_and_reports_its_status(tmp_path):
    library = linuxcnc(load("delta"), tmp_path)
    world, joints = EmcPose(z=-9000.0), (ctypes.c_double * 16)()
    assert library.kinematicsInverse(ctypes.byref(world), joints, None, None) == -1
    library.report()
    assert ctypes.c_int.in_dll(library, "status").value != 0


def test_linuxcnc_has_no_forward_kinematics_where_actuators_are_more_than_freedoms(tmp_path):
    library = linuxcnc(load("passive-leg-3dof-pu-driven"), tmp_path)
    assert library.kinematicsType() == 3
    assert library.kinematicsForward((ctypes.c_double * 16)(), ctypes.byref(EmcPose()), None, None) == -1


class Mex:
    """The function that `mex` would make, called with arrays whose columns are points."""

    class Array(ctypes.Structure):
        _fields_ = [("shape", ctypes.c_size_t * 3), ("numbers", ctypes.c_void_p), ("text", ctypes.c_char_p)]

    def __init__(self, machine, folder, **channels):
        paths = export(machine, folder / "pkm.c", to="mex", **channels)
        assert [path.name for path in paths] == ["pkm.c", "pkm.h", "pkm_mex.c"]
        (folder / "mex.h").write_text(MEX_H)
        self._library = compiled(folder, [folder / "pkm.c", folder / "pkm_mex.c"])

    def __call__(self, task, *arrays, results=3):
        columns = [np.asfortranarray(array, dtype=float) for array in arrays]
        given = [self.Array((0, 0, 0), None, task.encode())]
        given += [self.Array((*array.shape, 1), array.ctypes.data, None) for array in columns]
        pointers = (ctypes.POINTER(self.Array) * len(given))(*map(ctypes.pointer, given))
        answers = (ctypes.POINTER(self.Array) * 3)()
        if not self._library.call(results, answers, len(given), pointers):
            raise ValueError((ctypes.c_char * 200).in_dll(self._library, "refusal").value.decode())
        found = [answer.contents for answer in answers[:results] if answer]
        return [
            np.ctypeslib.as_array(
                ctypes.cast(a.numbers, ctypes.POINTER(ctypes.c_double)), (a.shape[0] * a.shape[1] * a.shape[2],)
            ).reshape(tuple(a.shape), order="F")
            for a in found
        ]


def test_matlab_gets_what_python_computes(tmp_path):
    machine = load("hexapod", LOADED)
    mex = Mex(machine, tmp_path, outputs=["compliance_x"])
    home = np.array([float(v) for path, v in values(machine).items() if path.startswith("pose.")])
    points = home[:, None] + np.array([[0.0, 0.001], [0.0, 0.002], [0.0, 0.003], [0.0, 0.01], [0.0, 0.02], [0.0, 0.03]])
    names = [path for path in values(machine) if path.startswith("pose.")]
    columns = dict(zip(names, points, strict=True))
    analysis = analyze(with_values(machine, {path: column[1] for path, column in columns.items()}))
    stiffness, compliance, status = mex("matrices", points)
    assert stiffness.shape == compliance.shape == (6, 6, 2)
    assert status.ravel().tolist() == [0, 0]
    np.testing.assert_allclose(compliance[:, :, 1], analysis.compliance, rtol=1e-11, atol=1e-22)
    np.testing.assert_allclose(stiffness[:, :, 1] @ compliance[:, :, 1], np.eye(6), atol=1e-10)
    coordinates, slopes, _ = mex("actuators", points)
    assert coordinates.shape == (6, 2, 1)
    ahead = points + 1e-7 * np.eye(6)[:, [0]]
    np.testing.assert_allclose(
        (mex("actuators", ahead)[0] - coordinates)[:, :, 0] / 1e-7, slopes[0], rtol=1e-4, atol=1e-6
    )
    back, status = mex("forward", coordinates[:, :, 0], points + 1e-3, results=2)
    np.testing.assert_allclose(back[:, :, 0], points, atol=1e-13)
    np.testing.assert_allclose(
        mex("command", points)[0][:, :, 0].T, actuator_targets(machine, columns, 2).coordinates, rtol=1e-12
    )
    assert np.abs(mex("rest", points)[0]).max() > 1e-7
    quantities, _, _ = mex("quantities", points)
    expected = evaluate(machine, PointTable(columns), ["compliance_x"]).values["compliance_x"]
    np.testing.assert_allclose(quantities[0, :, 0], expected, rtol=1e-12)


def test_matlab_is_told_how_to_call(tmp_path):
    mex = Mex(load("delta"), tmp_path)
    with pytest.raises(ValueError, match=r"pkm_mex\('matrices', points\)"):
        mex("stiffness", np.zeros((3, 1)))
    with pytest.raises(ValueError, match="must be real doubles with 3 rows"):
        mex("matrices", np.zeros((2, 1)))
    with pytest.raises(ValueError, match="as many columns"):
        mex("forward", np.zeros((3, 2)), np.zeros((3, 1)))


@pytest.fixture(scope="module")
def hexapod_fmu(tmp_path_factory):
    """A valid model of a loaded hexapod, for both kinds of simulation."""
    path = tmp_path_factory.mktemp("model") / "hexapod.fmu"
    export(load("hexapod", LOADED), path, inputs=["tool.offset.2"], outputs=["compliance_x"])
    assert fmpy.validation.validate_fmu(str(path)) == []
    return path


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_the_model_is_valid_and_gives_what_python_computes(kind, hexapod_fmu):
    machine = load("hexapod", LOADED)
    reached = with_values(machine, {"pose.x": 0.003, "pose.roll": 0.02})
    starts = {f"driven.{a.name}": float(a.coordinate) for a in stand(reached)}
    outputs = ["K", "C", "coordinate.leg 3 actuator", "command.leg 3 actuator", "compliance_x", "status"]
    outputs += ["displacement", "reached.x", "reached.roll", "reached.status"]
    starts |= {"pose.x": 0.003, "pose.roll": 0.02}
    rows = fmpy.simulate_fmu(
        str(hexapod_fmu), fmi_type=kind, stop_time=1.0, output_interval=1.0, start_values=starts, output=outputs
    )
    row = rows[-1]
    analysis = analyze(reached)
    assert row["status"] == row["reached.status"] == 0
    np.testing.assert_allclose(row["C"], analysis.compliance, rtol=1e-11, atol=1e-22)
    np.testing.assert_allclose(row["K"], analysis.stiffness, rtol=1e-9, atol=1e-3)
    assert row["coordinate.leg 3 actuator"] == pytest.approx(starts["driven.leg 3 actuator"], rel=1e-12)
    assert row["reached.x"] == pytest.approx(0.003, abs=1e-13)
    assert row["reached.roll"] == pytest.approx(0.02, abs=1e-12)
    columns = {p: np.array([float(v)]) for p, v in values(reached).items() if p.startswith("pose.")}
    assert row["command.leg 3 actuator"] == pytest.approx(
        actuator_targets(machine, columns, 1).coordinates[0, 2], rel=1e-12
    )


def test_the_model_holds_its_sources_and_the_machine_file(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    path = export(load("delta"), tmp_path / "delta.fmu")[0]
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        assert load(archive.extract("resources/delta.toml", tmp_path)).family.name == "delta"
    assert not any(name.startswith("binaries") for name in names), "there is no compiler on the path"
    assert {"sources/delta.c", "sources/delta.h", "sources/fmi3.c", "sources/buildDescription.xml"} <= set(names)


def test_a_name_in_a_file_ends_no_declaration(tmp_path):
    machine = replace(load("delta"), name='a"; */ <b> --> \\ ??/ x')
    text = export(machine, tmp_path / "k.comp", to="linuxcnc")[0].read_text("ascii")
    assert text.splitlines()[0].count('"') == 2
    assert fmpy.read_model_description(str(export(machine, tmp_path / "k.fmu")[0])).modelName == machine.name
    with pytest.raises(InputError, match="a name in C"):
        export(machine, tmp_path / "ü.comp", to="linuxcnc")
