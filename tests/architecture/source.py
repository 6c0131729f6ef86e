"""The source of the package as syntax trees, and what each module imports."""

import ast
from collections.abc import Callable, Collection, Iterable
from functools import cache
from pathlib import Path

import kinetostat

ROOT = Path(kinetostat.__file__).parent
PACKAGE = "kinetostat"


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules() -> dict[str, ast.Module]:
    """Every module of the package, parsed."""
    return {module_name(path): ast.parse(path.read_text("utf-8"), str(path)) for path in sorted(ROOT.rglob("*.py"))}


def is_package(module: str) -> bool:
    return (ROOT.parent / module.replace(".", "/")).is_dir()


def wrong_in(check: Callable[[str], Collection[str]], names: Iterable[str] | None = None) -> dict[str, Collection[str]]:
    """What a rule finds wrong, by module; empty where all modules keep it."""
    wrong = {module: check(module) for module in (modules() if names is None else names)}
    return {module: places for module, places in wrong.items() if places}


@cache
def imports(module: str) -> frozenset[str]:
    """Full names of the modules, ours and others, that a module imports anywhere in its text."""
    found: set[str] = set()
    for node in ast.walk(modules()[module]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= _from(module, node)
    return frozenset(found)


def _from(module: str, node: ast.ImportFrom) -> set[str]:
    origin = node.module or ""
    if node.level:
        here = module.split(".") if is_package(module) else module.split(".")[:-1]
        base = here[: len(here) - node.level + 1]
        origin = ".".join([*base, *filter(None, [node.module])])
    names = {f"{origin}.{alias.name}" for alias in node.names}
    submodules = {name for name in names if name in modules()}
    return submodules if submodules and len(submodules) == len(names) else {origin, *submodules}
