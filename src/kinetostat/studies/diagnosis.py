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


def _sound_check(group: str, name: str, detail: str) -> InstallationCheck:
    return InstallationCheck(group=group, name=name, state=Soundness.SOUND, detail=detail)


def _failure(group: str, name: str, detail: str, fix: str) -> InstallationCheck:
    return InstallationCheck(group=group, name=name, state=Soundness.FAILED, detail=detail, fix=fix)


Checks: TypeAlias = Callable[[], Iterator[InstallationCheck]]
"""A function that makes checks one by one."""


class UnsoundError(Exception):
    """A check has found a fault, which the message names."""


def check_of(group: str, name: str, question: Callable[[], str], fix: str) -> InstallationCheck:
    """Ask a question and return its answer as a check; whatever it raises is a failure, as anything may be broken."""
    try:
        return _sound_check(group, name, question())
    except UnsoundError as fault:
        return _failure(group, name, str(fault), fix)
    except Exception as error:
        return _failure(group, name, f"{type(error).__name__}: {_first_line(error)}", fix)


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0]


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
        except Exception as error:
            detail = f"cannot be looked at, {type(error).__name__}: {_first_line(error)}"
            yield _failure(group, group, detail, reinstall(PACKAGE))


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
        yield _sound_check(group, PACKAGE, version(PACKAGE))
    except PackageNotFoundError:
        detail = "runs from its source files and is not installed: what it needs cannot be looked up"
        yield _failure(group, PACKAGE, detail, install_command([PACKAGE]))
        return
    yield _sound_check(group, "python", f"{platform.python_version()} ({platform.python_implementation()})")
    for requirement in requirements():
        yield _package_check(group, requirement)
    for extra in metadata(PACKAGE).get_all("Provides-Extra") or ():
        yield _extra_check(extra)


def requirements(extra: str = "") -> "list[Requirement]":
    """Packages that kinetostat needs on this system; with an extra, those that the extra adds."""
    from packaging.requirements import Requirement

    listed = [Requirement(text) for text in requires(PACKAGE) or ()]
    core = [each for each in listed if each.marker is None or each.marker.evaluate({"extra": ""})]
    if not extra:
        return core
    return [each for each in listed if each not in core and each.marker and each.marker.evaluate({"extra": extra})]


def _package_check(group: str, requirement: "Requirement") -> InstallationCheck:
    """Whether a package that is needed is installed, in a version that suits, and loads."""
    name, specifier, present = requirement.name, requirement.specifier, _installed_version(requirement)
    if present is None:
        return _failure(group, name, "is not installed", install_command([f"{name}{specifier}"]))
    if not specifier.contains(present, prereleases=True):
        detail = f"{present} is installed, but {specifier} is needed"
        return _failure(group, name, detail, install_command([f"{name}{specifier}"]))
    try:
        import_module(LOADED_MODULES[name.lower()])
    except Exception as error:
        return _failure(
            group, name, f"{present} is installed, but does not load: {_first_line(error)}", reinstall(name)
        )
    return _sound_check(group, name, present)


def _extra_check(extra: str) -> InstallationCheck:
    """Whether all that an extra adds is installed."""
    versions_by_name = {requirement.name: _installed_version(requirement) for requirement in requirements(extra)}
    missing = [name for name, present in versions_by_name.items() if present is None]
    if missing:
        detail, fix = f"not installed ({', '.join(missing)})", extra_command(extra)
        return InstallationCheck(group="extras", name=extra, state=Soundness.ABSENT, detail=detail, fix=fix)
    return _sound_check("extras", extra, ", ".join(f"{name} {present}" for name, present in versions_by_name.items()))


def _installed_version(requirement: "Requirement") -> str | None:
    try:
        return version(requirement.name)
    except PackageNotFoundError:
        return None


def machine_checks() -> Iterator[InstallationCheck]:
    """System, processor, its vectors, and memory."""
    group, system = "machine", f"{platform.system()} {platform.release()}, {platform.machine()}"
    yield _sound_check(group, "system", system)
    yield check_of(group, "processor", _cores, reinstall("numpy"))
    yield check_of(group, "vectors", _vectors, reinstall("llvmlite"))
    memory = _memory_size()
    if memory is not None:
        yield _sound_check(group, "memory", f"{memory / 2**30:.1f} GiB")


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
