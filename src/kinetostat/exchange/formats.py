"""The export formats: their names, their suffixes, and which function writes each; `export` chooses one and calls it.

A format is added here as one row of `KNOWN`. Its writer is imported only when it is used, so that the list is cheap.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.analysis import Analysis, analyze


@dataclass(frozen=True)
class Format:
    """A file format of another program.

    Attributes:
        name: as in `kinetostat export --to`.
        suffix: of its files.
        writer: "module.function" in this package; the function takes an analysis and a path, writes, and returns the
            paths of the files it made.
        summary: what is in it, for lists.
        other_suffixes: suffixes that are also common for its files.
    """

    name: str
    suffix: str
    writer: str
    summary: str
    other_suffixes: tuple[str, ...] = ()

    def write(self, analysis: Analysis, path: Path) -> list[Path]:
        """Write the machine, or its results at the pose, whole or not at all, and return the paths of the files.

        Args:
            analysis: of the machine, at a pose where its status is OK.
            path: of the file; one that is there is replaced.

        Raises:
            InputError: the format cannot hold this machine, or the file cannot be written.
        """
        module, _, function = self.writer.partition(".")
        write: Callable[[Analysis, Path], list[Path]] = getattr(import_module(f"{__package__}.{module}"), function)
        return write(analysis, path)


KNOWN = (
    Format("mjcf", ".xml", "mjcf.write", "machine for MuJoCo: bodies, joints, springs, closed loops"),
    Format(
        "urdf",
        ".urdf",
        "urdf_export.write",
        "machine as URDF with closed loops and stiffnesses; read back by new --from",
    ),
    Format("glb", ".glb", "solids.write_glb", "solids of the machine at its pose, for any 3-D viewer"),
    Format(
        "step",
        ".step",
        "solids.write_step",
        "solids of the machine as exact bodies, an assembly for CAD programs",
        (".stp",),
    ),
    Format("csv", ".csv", "results_files.write_csv", "results at the pose, a number a line with its unit"),
    Format("netcdf", ".nc", "results_files.write_netcdf", "results at the pose, labelled, with units"),
    Format("mat", ".mat", "results_files.write_mat", "K, C, pose and reference point for MATLAB"),
    Format("nastran", ".bdf", "finite_elements.write_nastran", "K at the tool point as DMIG"),
    Format("abaqus", ".inp", "finite_elements.write_abaqus", "K at the tool point as a linear user element"),
    Format("ansys", ".mac", "finite_elements.write_ansys", "K at the tool point as MATRIX27, in APDL"),
)
"""Every format, machines first."""


def choose(name: str | None, path: Path | None) -> Format:
    """Return the format with a name or, without a name, the one that the suffix of a file belongs to.

    Raises:
        InputError: the name or suffix belongs to none.
    """
    if name is not None:
        known = {form.name: form for form in KNOWN}
        return known[choice(name, known, "--to")]
    suffix = "" if path is None else path.suffix.lower()
    for form in KNOWN:
        if suffix in (form.suffix, *form.other_suffixes):
            return form
    names = ", ".join(f"{form.name} ({form.suffix})" for form in KNOWN)
    raise InputError(
        "The format of the export is missing; name it with --to, or give -o a file with one of these suffixes: "
        f"{names}."
    )


@checked
def export(machine: Machine, path: str | Path, to: str | None = None) -> list[Path]:
    """Write a machine, or its results at its pose, in the format of another program, whole or not at all.

    Args:
        machine: at a pose where it can be analysed.
        path: of the file; one that is there is replaced.
        to: name of the format, as in `kinetostat export --to`; None to go by the suffix of the path.

    Returns:
        The paths of the files: some formats need several.

    Raises:
        InputError: an unknown format, a pose without a result, a machine that the format cannot hold, or a file that
            cannot be written.
    """
    form, analysis = choose(to, Path(path)), analyze(machine)
    if analysis.status is not Status.OK:
        raise InputError(analysis.message)
    return form.write(analysis, Path(path))


def one_line(text: str) -> str:
    """Return a name in one line and without characters that XML cannot hold: they become question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def ascii_line(text: str) -> str:
    """Return a name in one line of ASCII, as finite-element programs read it."""
    return one_line(text).encode("ascii", "replace").decode("ascii")
