"""Which formats there are, and which of our modules writes each; a machine is exported by one of them."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from kinetostat.kinematics.status import Status
from kinetostat.machine.machine import Machine
from kinetostat.spec.errors import InputError, choice
from kinetostat.studies.analysis import Analysis, analyze


@dataclass(frozen=True)
class Format:
    """A format of another program.

    Attributes:
        name: by which it is asked for.
        suffix: of its files.
        writer: our module whose `write(analysis, path)` makes a file of it and returns the files that it made.
        summary: what is in it, for lists.
        other_suffixes: of its files, as some write them.
    """

    name: str
    suffix: str
    writer: str
    summary: str
    other_suffixes: tuple[str, ...] = ()

    def write(self, analysis: Analysis, path: Path) -> list[Path]:
        """Write the machine, or its results at the pose, whole or not at all; returns what was written.

        Args:
            analysis: of the machine, at a pose where its status is OK.
            path: of the file; one that is there is replaced.

        Raises:
            InputError: what the format cannot hold, or a place that cannot be written.
        """
        write: Callable[[Analysis, Path], list[Path]] = import_module(f"kinetostat.exchange.{self.writer}").write
        return write(analysis, path)


KNOWN = (
    Format("mjcf", ".xml", "mjcf", "machine for MuJoCo: bodies, joints, springs, closed loops"),
    Format("urdf", ".urdf", "urdf", "machine as URDF with closed loops and stiffnesses; read back by new --from"),
    Format("glb", ".glb", "glb", "solids of the machine at its pose, for any 3-D viewer"),
    Format("step", ".step", "step", "solids of the machine as exact bodies, an assembly for CAD programs", (".stp",)),
    Format("csv", ".csv", "results_csv", "results at the pose, a number a line with its unit"),
    Format("netcdf", ".nc", "results", "results at the pose, labelled, with units"),
    Format("mat", ".mat", "mat", "K, C, pose and reference point for MATLAB"),
    Format("nastran", ".bdf", "nastran", "K at the tool point as DMIG"),
    Format("abaqus", ".inp", "abaqus", "K at the tool point as a linear user element"),
    Format("ansys", ".mac", "ansys", "K at the tool point as MATRIX27, in APDL"),
)
"""Every format, machines first."""


def choose(name: str | None, path: Path | None) -> Format:
    """The format of that name, or the one to which the suffix of a file belongs.

    Raises:
        InputError: if there is none.
    """
    if name is not None:
        known = {one.name: one for one in KNOWN}
        return known[choice(name, known, "--to")]
    suffix = "" if path is None else path.suffix.lower()
    found = [one for one in KNOWN if suffix in (one.suffix, *one.other_suffixes)]
    if not found:
        names = ", ".join(f"{one.name} ({one.suffix})" for one in KNOWN)
        raise InputError(f"No format is named; give --to, or a file with -o that ends as one of: {names}.")
    return found[0]


def export(machine: Machine, path: str | Path, to: str | None = None) -> list[Path]:
    """Write a machine, or its results at its pose, in the format of another program, whole or not at all.

    Args:
        machine: at a pose that has an answer.
        path: of the file; one that is there is replaced.
        to: name of the format, as in `kinetostat export --to`; None to go by the suffix of the path.

    Returns:
        What was written: some formats need several files.

    Raises:
        InputError: an unknown format, no answer at the pose, what the format cannot hold, or a place that cannot be
            written.
    """
    chosen, found = choose(to, Path(path)), analyze(machine)
    if found.status is not Status.OK:
        raise InputError(found.message)
    return chosen.write(found, Path(path))
