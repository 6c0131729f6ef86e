"""The export formats: their names, their suffixes, and which function writes each; `export` chooses one and calls it.

A format is added here as one row of `FORMATS`. Its writer is imported only when it is used, so that the list is cheap.
Below it stand the helpers that several writers share: the reference point, and names in one line.
"""

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

from kinetostat.arrays import Array
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.analysis import Analysis, analyze


@dataclass(frozen=True)
class Format:
    """A file format of another program.

    Attributes:
        name: the name as in `kinetostat export --to`.
        suffix: the suffix of its files.
        writer: "module.function" in kinetostat; the function takes an analysis and a path, writes, and returns the
            paths of the files it made.
        summary: the words on its content, for lists.
        other_suffixes: suffixes that are also common for its files.
        options: names of arguments that its function takes besides: "inputs", "outputs", "over".
    """

    name: str
    suffix: str
    writer: str
    summary: str
    other_suffixes: tuple[str, ...] = ()
    options: tuple[str, ...] = ()

    def write(self, analysis: Analysis, path: Path, **options: Sequence[str] | None) -> list[Path]:
        """Write the machine, or its results at the pose, whole or not at all, and return the paths of the files.

        Args:
            analysis: the analysis of the machine, at a pose where its status is OK.
            path: the path of the file; one that is there is replaced.
            options: names of `inputs` and of `outputs`, ranges `over`; None for what the format has by itself.

        Raises:
            InputError: the format cannot hold this machine, has no such option, or the file cannot be written.
        """
        chosen = {kind: names for kind, names in options.items() if names is not None}
        for kind in chosen:
            if kind not in self.options:
                others = ", ".join(form.name for form in FORMATS if kind in form.options)
                raise InputError(f"The format {self.name} has no {kind} to choose; {others} have: use --to.")
        module, _, function = self.writer.rpartition(".")
        write: Callable[..., list[Path]] = getattr(import_module(f"kinetostat.{module}"), function)
        return write(analysis, path, **chosen)


CHANNELS = ("inputs", "outputs")
"""Options of formats that hold functions or a state space: names of their arguments and of their results."""
FORMATS = (
    Format("mjcf", ".xml", "exchange.mjcf.write", "machine for MuJoCo: bodies, joints, springs, closed loops"),
    Format(
        "mjcf-vibration",
        ".xml",
        "exchange.mjcf.write_vibrating",
        "the same with the machine's own masses and no damping: it vibrates as the machine does",
    ),
    Format(
        "urdf",
        ".urdf",
        "exchange.urdf_export.write",
        "machine as URDF with closed loops and stiffnesses; read back by new --from",
    ),
    Format(
        "c",
        ".c",
        "exchange.c_source.write",
        "functions in C99: K, C, actuators, derivatives, the way back, the command under load",
        options=CHANNELS,
    ),
    Format(
        "mex",
        ".c",
        "exchange.c_programs.write_mex",
        "the same functions for MATLAB and Octave: C with the adapter that mex compiles",
        options=CHANNELS,
    ),
    Format(
        "linuxcnc",
        ".comp",
        "exchange.c_programs.write_linuxcnc",
        "kinematics for LinuxCNC, compensated under load if wanted: a component for halcompile",
    ),
    Format(
        "fmu",
        ".fmu",
        "exchange.c_programs.write_fmu",
        "model of FMI 3.0 for co-simulation: K, C, actuators and the way back, from pose and parameters",
        options=CHANNELS,
    ),
    Format(
        "page",
        ".html",
        "views.live_page.write",
        "one file for a browser: picture, sliders, K, C, actuators and a map, by the machine's own formulas",
        options=CHANNELS,
    ),
    Format(
        "link",
        ".link",
        "views.live_page.write_link",
        "the same as the end of an address, of at most 8 kB for most machines, for a viewer page",
        options=CHANNELS,
    ),
    Format("glb", ".glb", "exchange.solids.write_glb", "solids of the machine at its pose, for any 3-D viewer"),
    Format(
        "step",
        ".step",
        "exchange.solids.write_step",
        "solids of the machine as exact bodies, an assembly for CAD programs",
        other_suffixes=(".stp",),
    ),
    Format("csv", ".csv", "exchange.results.write_csv", "results at the pose, a number a line with its unit"),
    Format("netcdf", ".nc", "exchange.results.write_netcdf", "results at the pose, labelled, with units"),
    Format("mat", ".mat", "exchange.results.write_mat", "K, C, pose and reference point for MATLAB"),
    Format(
        "modes",
        ".csv",
        "exchange.results.write_modes",
        "natural frequencies, motions of the tool and modal masses, as modes -o writes them",
        other_suffixes=(".nc",),
    ),
    Format(
        "state-space",
        ".mat",
        "exchange.results.write_state_space",
        "A, B, C, D of the vibrating machine, from chosen forces to chosen motions",
        other_suffixes=(".nc",),
        options=CHANNELS,
    ),
    Format(
        "klipper",
        ".cfg",
        "exchange.height_map.write_klipper",
        "heights over x and y that keep the loaded tool at its z, as a mesh of Klipper",
        options=("over",),
    ),
    Format(
        "reprapfirmware",
        ".csv",
        "exchange.height_map.write_reprapfirmware",
        "the same as a height map of RepRapFirmware",
        options=("over",),
    ),
    Format("nastran", ".bdf", "exchange.finite_elements.write_nastran", "K at the tool point as DMIG"),
    Format("abaqus", ".inp", "exchange.finite_elements.write_abaqus", "K at the tool point as a linear user element"),
    Format("ansys", ".mac", "exchange.finite_elements.write_ansys", "K at the tool point as MATRIX27, in APDL"),
)
"""Every format, machines first; a suffix belongs to the first of those that have it."""


def format_for(name: str | None, path: Path | None) -> Format:
    """Return the format with a name or, without a name, the one that the suffix of a file belongs to.

    Raises:
        InputError: the name or suffix belongs to none.
    """
    if name is not None:
        by_name = {form.name: form for form in FORMATS}
        return by_name[choice(name, by_name, "--to")]
    by_suffix = {suffix: form for form in reversed(FORMATS) for suffix in (form.suffix, *form.other_suffixes)}
    if path is not None and path.suffix.lower() in by_suffix:
        return by_suffix[path.suffix.lower()]
    names = ", ".join(f"{form.name} ({form.suffix})" for form in FORMATS if by_suffix[form.suffix] is form)
    raise InputError(
        "The format of the export is missing; name it with --to, or give -o a file with one of these suffixes: "
        f"{names}."
    )


@checked
def export(
    machine: Machine,
    path: str | Path,
    to: str | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    over: Sequence[str] | None = None,
) -> list[Path]:
    """Write a machine, or its results at its pose, in the format of another program, whole or not at all.

    Args:
        machine: the machine at a pose where it can be analysed.
        path: the path of the file; one that is there is replaced.
        to: name of the format, as in `kinetostat export --to`; None to go by the suffix of the path.
        inputs, outputs: of a state space, names of forces fx fy fz mx my mz at the tool point, of motions
            x y z rx ry rz there, and of actuators in both; forces and motions of the tool point if None. Of C, a page
            and their like, leaf paths of parameters that become arguments, and names of quantities.
        over: the ranges of x and y of maps of heights, as "x=-100 mm:100 mm:9".

    Returns:
        The paths of the files: some formats need several.

    Raises:
        InputError: an unknown format, a pose without a result, a machine that the format cannot hold, or a file that
            cannot be written.
    """
    form, analysis = format_for(to, Path(path)), analyze(machine)
    if analysis.status is not Status.OK:
        raise InputError(analysis.message)
    return form.write(analysis, Path(path), inputs=inputs, outputs=outputs, over=over)


def reference_point(analysis: Analysis) -> list[float]:
    """Return the point of K and C in the base frame, m [3]: the tool point T, in the plane of a planar machine.

    Raises:
        ValueError: the analysis has no result.
    """
    platform_of(analysis)  # refuses an analysis without a result, whose machine has no place
    point = analysis.machine.reference_point(analysis.state.configuration)
    return [float(c) for c in point.components()]


def platform_of(analysis: Analysis) -> tuple[Array, Array]:
    """Return the position of the platform, m [3], and its rotation [3 x 3], base frame.

    Raises:
        ValueError: the analysis has no result; its status should have been looked at.
    """
    if analysis.platform is None:
        raise ValueError("an analysis without a result cannot be exported")
    return analysis.platform


def one_line(text: str) -> str:
    """Return a name in one line and without characters that XML cannot hold: they become question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def ascii_line(text: str) -> str:
    """Return a name in one line of ASCII, as finite-element programs read it."""
    return one_line(text).encode("ascii", "replace").decode("ascii")
