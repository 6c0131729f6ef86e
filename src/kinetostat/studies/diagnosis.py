"""Checks of an installation: its packages and the computer that they run on. The self-test has a file of its own.

Anything may be broken here. Therefore each question is asked by itself, a broken library is a finding like any other,
and libraries are imported only when their turn comes.
"""

import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from kinetostat.frozen import dataclass
from kinetostat.late import ARRAY_LIBRARIES, show_array_libraries
from kinetostat.spec.installation import extra_command, install_command
from kinetostat.spec.renamed import with_former_keys

if TYPE_CHECKING:
    from packaging.requirements import Requirement

PACKAGE = "kinetostat"
"""Name of the package, under which it is installed."""
LOADED_MODULES = {
    "h5netcdf": "h5netcdf",
    "h5py": "h5py",
    "llvmlite": "llvmlite.binding",
    "matplotlib": "matplotlib.figure",
    "numpy": "numpy",
    "packaging": "packaging.requirements",
    "pillow": "PIL.Image",
    "pint": "pint",
    "pydantic": "pydantic",
    "pymoo": "pymoo.operators.crossover.sbx",
    "rich": "rich.console",
    "scipy": "scipy.optimize",
    "tomlkit": "tomlkit",
    "xarray": "xarray",
}
"""The module of each package that must load, because the program uses it."""


class Soundness(StrEnum):
    """Result of a check."""

    SOUND = "sound"
    ABSENT = "absent"
    """Not installed, and not needed."""
    FAILED = "failed"


@dataclass(frozen=True)
class InstallationCheck:
    """Result of one check of the installation.

    Attributes:
        group: heading under which it is listed.
        name: name of the part that was checked.
        state: the result.
        detail: one sentence or number.
        fix: the remedy, where there is one.
    """

    group: str
    name: str
    state: Soundness
    detail: str
    fix: str = ""

    @property
    def is_sound(self) -> bool:
        return self.state is Soundness.SOUND

    @property
    def is_failed(self) -> bool:
        return self.state is Soundness.FAILED


Checks: TypeAlias = Callable[[], Iterator[InstallationCheck]]
"""A function that makes checks one by one."""


class UnsoundError(Exception):
    """A check has found a fault, which the message names."""


def check_of(group: str, name: str, question: Callable[[], str], fix: str) -> InstallationCheck:
    """Ask a question and return its answer as a check; whatever it raises is a failure, as anything may be broken."""
    try:
        return InstallationCheck(group=group, name=name, state=Soundness.SOUND, detail=question())
    except UnsoundError as wrong:
        return InstallationCheck(group=group, name=name, state=Soundness.FAILED, detail=str(wrong), fix=fix)
    except Exception as trouble:
        return InstallationCheck(
            group=group,
            name=name,
            state=Soundness.FAILED,
            detail=f"{type(trouble).__name__}: {_first_line(trouble)}",
            fix=fix,
        )


def _first_line(trouble: Exception) -> str:
    return str(trouble).partition("\n")[0]


def reinstall(packages: str) -> str:
    """The command that mends packages."""
    return install_command(packages.split(), again=True)


def diagnose(parts: Mapping[str, Checks]) -> Iterator[InstallationCheck]:
    """Make the checks of several parts; one that breaks as a whole is a failure of its group.

    Args:
        parts: functions that make checks, by the group under which they are listed.
    """
    show_array_libraries(*ARRAY_LIBRARIES)
    for group, checks in parts.items():
        try:
            yield from checks()
        except Exception as trouble:
            text = f"cannot be looked at, {type(trouble).__name__}: {_first_line(trouble)}"
            yield InstallationCheck(
                group=group, name=group, state=Soundness.FAILED, detail=text, fix=reinstall(PACKAGE)
            )


def healthy(checks: Sequence[InstallationCheck]) -> bool:
    """Whether none of the checks has failed."""
    return not any(check.is_failed for check in checks)


def as_json(checks: Sequence[InstallationCheck]) -> dict[str, Any]:
    """Write the verdict, then the result of each check by group and name, as plain data."""
    groups: dict[str, Any] = {}
    for check in checks:
        entry = {"state": check.state.value, "detail": check.detail} | ({"fix": check.fix} if check.fix else {})
        groups.setdefault(check.group, {})[check.name] = entry
    return with_former_keys({"healthy": healthy(checks), **groups}, {"said": "detail"})


def software_checks() -> Iterator[InstallationCheck]:
    """The package itself, Python, every package that it needs, and what every extra adds."""
    group = "software"
    try:
        yield InstallationCheck(group=group, name=PACKAGE, state=Soundness.SOUND, detail=version(PACKAGE))
    except PackageNotFoundError:
        text = "runs from its source files and is not installed: what it needs cannot be looked up"
        yield InstallationCheck(
            group=group, name=PACKAGE, state=Soundness.FAILED, detail=text, fix=install_command([PACKAGE])
        )
        return
    python = f"{platform.python_version()} ({platform.python_implementation()})"
    yield InstallationCheck(group=group, name="python", state=Soundness.SOUND, detail=python)
    for requirement in requirements():
        state, text, fix = _package_state(requirement)
        yield InstallationCheck(group=group, name=requirement.name, state=state, detail=text, fix=fix)
    for extra in metadata(PACKAGE).get_all("Provides-Extra") or ():
        yield _extra_check(extra)


def requirements(extra: str = "") -> "list[Requirement]":
    """Packages that kinetostat needs on this system; with an extra, those that the extra adds."""
    from packaging.requirements import Requirement

    listed = [Requirement(text) for text in requires(PACKAGE) or ()]
    core = [needed for needed in listed if needed.marker is None or needed.marker.evaluate({"extra": ""})]
    if not extra:
        return core
    return [
        needed for needed in listed if needed not in core and needed.marker and needed.marker.evaluate({"extra": extra})
    ]


def _package_state(requirement: "Requirement") -> tuple[Soundness, str, str]:
    """Whether a package that is needed is installed, in a version that suits, and loads: state, detail and remedy."""
    wanted = f"{requirement.name}{requirement.specifier}"
    present = _installed_version(requirement)
    if present is None:
        return Soundness.FAILED, "is not installed", install_command([wanted])
    if not requirement.specifier.contains(present, prereleases=True):
        text = f"{present} is installed, but {requirement.specifier} is needed"
        return Soundness.FAILED, text, install_command([wanted])
    try:
        import_module(LOADED_MODULES[requirement.name.lower()])
    except Exception as trouble:
        text = f"{present} is installed, but does not load: {_first_line(trouble)}"
        return Soundness.FAILED, text, reinstall(requirement.name)
    return Soundness.SOUND, present, ""


def _extra_check(extra: str) -> InstallationCheck:
    """Whether all that an extra adds is installed."""
    versions_by_name = {requirement.name: _installed_version(requirement) for requirement in requirements(extra)}
    missing = [name for name, present in versions_by_name.items() if present is None]
    if missing:
        text = f"not installed ({', '.join(missing)})"
        return InstallationCheck(
            group="extras", name=extra, state=Soundness.ABSENT, detail=text, fix=extra_command(extra)
        )
    versions = ", ".join(f"{name} {present}" for name, present in versions_by_name.items())
    return InstallationCheck(group="extras", name=extra, state=Soundness.SOUND, detail=versions)


def _installed_version(requirement: "Requirement") -> str | None:
    try:
        return version(requirement.name)
    except PackageNotFoundError:
        return None


def machine_checks() -> Iterator[InstallationCheck]:
    """System, processor, its vectors, and memory."""
    group, system = "machine", f"{platform.system()} {platform.release()}, {platform.machine()}"
    yield InstallationCheck(group=group, name="system", state=Soundness.SOUND, detail=system)
    yield check_of(group, "processor", _cores, reinstall("numpy"))
    yield check_of(group, "vectors", _vectors, reinstall("llvmlite"))
    memory = _memory_size()
    if memory is not None:
        yield InstallationCheck(group=group, name="memory", state=Soundness.SOUND, detail=f"{memory / 2**30:.1f} GiB")


def processor() -> str:
    """The name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _cores() -> str:
    """The processor, and how many of its cores this process may use."""
    from kinetostat.engine.batch import available_cores

    return f"{processor()}, {available_cores()} cores for this process"


def _vectors() -> str:
    """Number of floats that one instruction of the machine code processes, and the features that allow it."""
    from kinetostat.engine.machine_code import host_features, host_lanes

    return f"{host_lanes()} numbers of 64 bits at once ({', '.join(host_features()) or 'the plainest'})"


def _memory_size() -> int | None:
    """Bytes of memory; None where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None
