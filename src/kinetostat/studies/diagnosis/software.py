"""Which packages are installed, suit and load, and which extras are there: from what the package says it needs."""

import platform
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata, requires, version

from packaging.requirements import Requirement

from kinetostat.spec.installation import adding, installing
from kinetostat.studies.diagnosis.diagnosis import Check, State, reinstall

PACKAGE = "kinetostat"
CORE, EXTRAS = "software", "extras"
USED = {
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
"""The part of each package that is used, which must load."""


def checks() -> Iterator[Check]:
    """The package itself, Python, what is needed, and what every extra adds."""
    try:
        yield Check(CORE, PACKAGE, State.SOUND, version(PACKAGE))
    except PackageNotFoundError:
        text = "runs from its source files and is not installed: what it needs cannot be looked up"
        yield Check(CORE, PACKAGE, State.FAILED, text, installing([PACKAGE]))
        return
    yield Check(CORE, "python", State.SOUND, f"{platform.python_version()} ({platform.python_implementation()})")
    for requirement in requirements():
        yield suited(requirement)
    for extra in metadata(PACKAGE).get_all("Provides-Extra") or ():
        yield extra_of(extra)


def requirements(extra: str = "") -> list[Requirement]:
    """What the package needs on this system; with an extra, what that adds."""
    every = [Requirement(text) for text in requires(PACKAGE) or ()]
    core = [
        requirement for requirement in every if requirement.marker is None or requirement.marker.evaluate({"extra": ""})
    ]
    if not extra:
        return core
    return [
        requirement
        for requirement in every
        if requirement not in core and requirement.marker and requirement.marker.evaluate({"extra": extra})
    ]


def suited(requirement: Requirement) -> Check:
    """Whether a package that is needed is installed, in a version that suits, and loads."""
    wanted = f"{requirement.name}{requirement.specifier}"
    present = installed(requirement)
    if present is None:
        return Check(CORE, requirement.name, State.FAILED, "is not installed", installing([wanted]))
    if not requirement.specifier.contains(present, prereleases=True):
        text = f"{present} is installed, but {requirement.specifier} is needed"
        return Check(CORE, requirement.name, State.FAILED, text, installing([wanted]))
    try:
        import_module(USED[requirement.name.lower()])
    except Exception as trouble:
        text = f"{present} is installed, but does not load: {str(trouble).partition(chr(10))[0]}"
        return Check(CORE, requirement.name, State.FAILED, text, reinstall(requirement.name))
    return Check(CORE, requirement.name, State.SOUND, present)


def extra_of(extra: str) -> Check:
    """Whether all that an extra adds is installed."""
    known = {requirement.name: installed(requirement) for requirement in requirements(extra)}
    missing = [name for name, present in known.items() if present is None]
    if missing:
        text = f"not installed ({', '.join(missing)})"
        return Check(EXTRAS, extra, State.ABSENT, text, adding(extra))
    return Check(EXTRAS, extra, State.SOUND, ", ".join(f"{name} {present}" for name, present in known.items()))


def installed(requirement: Requirement) -> str | None:
    """The version of a package here; None if there is none."""
    try:
        return version(requirement.name)
    except PackageNotFoundError:
        return None
