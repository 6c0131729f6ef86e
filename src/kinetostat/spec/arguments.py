"""Arguments of public functions in Python: each is of the kind that its annotation says, or is refused.

Only kinds are compared here: whether a text names something, or a number is within its bounds, the function itself
checks. The words below tell people what to give in place of something of another kind.
"""

import inspect
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Set
from functools import wraps
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, Literal, NamedTuple, ParamSpec, TypeVar, Union, get_args, get_origin

from kinetostat.spec.errors import InputError, hint, shorten

P = ParamSpec("P")
R = TypeVar("R")

WORDS_OF_CLASSES = {
    "Machine": "a machine, as load(...) and build(...) return one",
    "MachineState": "a machine in a state, as state_of(...) returns one",
    "Problem": "a problem, as load_problem(...) returns one",
    "Family": "a Family, as docs/extending.md shows",
    "bool": "True or False",
}
"""Words for an argument, by the name of the class in the annotation. They come before those by its own name."""
WORDS_OF_NAMES = {
    "about": "a machine, or the result of a study",
    "acceleration": 'an acceleration, e.g. "5 m/s**2"',
    "actuators": 'a dictionary with a coordinate for each actuator, e.g. {"leg 1": "31 cm"}',
    "allocate": 'a length, e.g. "0.05 mm"',
    "along": "three numbers, e.g. (0, 0, 1)",
    "author": "a text",
    "axes": '"base" or "platform"',
    "bounds": 'a dictionary of limits, e.g. {"zeros": "1 mm"}',
    "by": '"rss" or "worst"',
    "catalogue": "the path of a TOML file of motors",
    "component": 'the name of a row of K and C, e.g. "x"',
    "conditions": 'conditions as texts, e.g. ["stiffness_z > 1 N/um"]',
    "count": "a whole number from 1",
    "cutting_pressure": 'a pressure, e.g. "2000 N/mm**2"',
    "data": "the path of a CSV file of measured poses",
    "date": 'a text, e.g. "2026-05-31"',
    "designs": "two or more designs in a list, each a machine or a text, or a dictionary of machines by name",
    "direction": "three numbers, e.g. (0, 0, 1)",
    "document": "the text of a machine file, or its tables as a dictionary",
    "elevations": 'a range of angles, e.g. "0 deg:90 deg:7"',
    "engine": 'the name of an engine, e.g. "exudyn"',
    "entry": 'an angle, e.g. "90 deg"',
    "exact": "a whole number from 0",
    "feed": "three numbers, e.g. (1, 0, 0)",
    "fields": 'a number, a text with its unit, or an array, e.g. x="5 mm"',
    "fit": 'groups or paths of parameters as texts, e.g. ["geometry", "zeros"]',
    "folder": "the path of a folder",
    "frequencies": "numbers in Hz",
    "gear": "the name of a gear of the catalogue",
    "hidden": 'layers as texts, e.g. ["frames", "labels"]',
    "highest": 'a frequency, e.g. "500 Hz"',
    "inputs": 'names as texts, e.g. ["x", "z"]',
    "key": '"line", "leg", "group" or "path"',
    "leaving": 'an angle, e.g. "180 deg"',
    "lowest": 'a frequency, e.g. "10 Hz"',
    "machine": "the name of a bundled machine, or the path of a file",
    "matrix": '"C" or "K"',
    "measure": 'the name of a measure, e.g. "position"',
    "more": "a whole number from 0",
    "motion": "a motion, or the path of its CSV file",
    "origin": "a name for messages",
    "outputs": 'what moves as texts, e.g. ["x", "z"]',
    "over": 'ranges as texts, e.g. ["x=-1 cm:1 cm:11"]',
    "path": "the path of a file",
    "points": "a whole number from 2",
    "priors": 'a dictionary of standard deviations, e.g. {"geometry": "0.1 mm"}',
    "progress": "a function of the steps done and of all steps",
    "quantities": 'names of quantities as texts, e.g. ["compliance_z"]',
    "radial": "a number from 0 to 10",
    "ranges": 'ranges as texts, e.g. ["x=-1 cm:1 cm:11"]',
    "samples": "a whole number from 0",
    "screw": "the name of a screw of the catalogue",
    "seed": "a whole number from 0",
    "settings": 'overrides as texts, e.g. ["pose.x=5 mm"]',
    "sigma": 'a standard deviation of lengths, e.g. "5 um"',
    "sigma_angle": 'a standard deviation of angles, e.g. "20 urad"',
    "size": "width and height in pixels, e.g. (1600, 1200)",
    "speed": 'a speed, e.g. "0.5 m/s"',
    "spindle": "three numbers, e.g. (0, 0, 1)",
    "spread": "a number greater than 0",
    "starts": "a whole number from 0",
    "statistic": '"mean", "rms", "rss", "usual" or "worst"',
    "stop": "a function that returns True or False",
    "study": "the name of a bundled study, or the path of a file",
    "teeth": "a whole number from 1",
    "tell": "a function of the steps done, of all steps, and of words on them",
    "ties": 'a dictionary of errors that are one number, e.g. {"rod": "geometry.rod_length.*"}',
    "to": 'the name of a format, e.g. "mjcf"',
    "tolerance": 'a length, e.g. "1 um"',
    "tolerances": 'a dictionary of tolerances, e.g. {"joints": "0.05 mm"}',
    "tool_receptance": "the path of a CSV file",
    "units": 'units as a text, e.g. "mm, deg, N/um"',
    "values": 'a dictionary with a value for each field, e.g. {"pose.z": "12 cm"}',
    "view": '"iso", "front", "side", "top", or three numbers',
    "watch": "a function of the steps done, of all steps, and of the best objective",
    "which": "the name of one of its tables or figures",
    "without": 'parts as texts, e.g. ["maps", "validation"]',
    "wrenches": "a row of six numbers for each load: moment in N·m, force in N",
}
"""Words for an argument, by its name in alphabetical order; a name means the same in every function."""
STAND_INS: Mapping[type, tuple[type, ...]] = {Path: (str, PathLike), int: (Integral,), float: (Real,)}
"""Classes whose objects are taken where an annotation names the first one."""
UNCHECKED = (Any, object, inspect.Parameter.empty)
"""Annotations that allow anything."""


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a public function: arguments that are missing, unknown or of another kind are refused by their names.

    Annotations say the kinds. Where one is a sequence, generators, arrays and tables of other libraries are read into
    a list; their numbers become Python's, whose sums neither overflow nor lose digits. Names of classes in quotes,
    `Any` and literal choices are left to the function.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*positional: P.args, **named: P.kwargs) -> R:
        try:
            bound = signature.bind(*positional, **named)
        except TypeError as error:
            raise InputError(_unbound(function.__name__, signature, named, str(error))) from None
        for name, value in bound.arguments.items():
            parameter = signature.parameters[name]
            if parameter.kind is not parameter.VAR_KEYWORD:
                bound.arguments[name] = _read_argument(value, parameter)
        return function(*bound.args, **bound.kwargs)

    return call


def as_list(texts: str | Iterable[str]) -> list[str]:
    """Return texts as a list; one text alone stands for a list of it."""
    return [texts] if isinstance(texts, str) else list(texts)


def _unbound(name: str, signature: inspect.Signature, named: Mapping[str, Any], reason: str) -> str:
    """Say which argument is unknown or missing, and what there is."""
    arguments = [argument for argument in signature.parameters if argument != "self"]
    takes = f"{name} takes {', '.join(arguments) or 'no argument'}."
    unknown = next((argument for argument in named if argument not in arguments), None)
    if unknown is None:
        return f"{name}: {reason}; {takes}"
    return f"{name} has no argument {unknown}; {hint(unknown, arguments, takes, quoted=False)}"


def _read_argument(value: Any, parameter: inspect.Parameter) -> Any:
    """Return an argument, from a generator or an array as a list, and a number as one of Python's.

    Raises:
        InputError: it is not of the kind that the annotation says.
    """
    kind, name = parameter.annotation, parameter.name
    if any(_is_of_lists(part) for part in _alternatives(kind)):
        value = _as_python_row(value)
    misfit = _misfit(value, kind, name)
    if misfit is not None:
        optional = ", or leave it out" if value is None and parameter.default is not parameter.empty else ""
        raise InputError(f"{misfit.place} is {shorten(misfit.value)}; give {words_of(parameter)}{optional}.")
    return _number_of_python(value)


def _as_python_row(value: Any) -> Any:
    """Return a generator or an array as a list, lists and tuples with Python's numbers, and all else as it is."""
    if isinstance(value, tuple):
        return tuple(map(_number_of_python, value))
    is_array = hasattr(value, "__array__") and not isinstance(value, Mapping) and getattr(value, "ndim", 0) > 0
    return [_number_of_python(entry) for entry in value] if is_array or isinstance(value, Iterator | list) else value


def _number_of_python(value: Any) -> Any:
    """Return a number of another library as one of Python's, because those of eight bits overflow at 127."""
    if isinstance(value, bool) or type(value) in (int, float):
        return value
    return int(value) if isinstance(value, Integral) else float(value) if isinstance(value, Real) else value


def words_of(parameter: inspect.Parameter) -> str:
    """Return what to give for a parameter of a public function."""
    names = (getattr(part, "__name__", "") for part in _alternatives(parameter.annotation))
    of_class = next((WORDS_OF_CLASSES[name] for name in names if name in WORDS_OF_CLASSES), "")
    return of_class or WORDS_OF_NAMES[parameter.name]


class Misfit(NamedTuple):
    """Something that is not of its kind: the place of it, such as "over[2]", and what stands there."""

    place: str
    value: object


def _misfit(value: Any, kind: Any, name: str) -> Misfit | None:
    """Return the first entry that does not fit a kind, or the whole if it is not a list; None if all fits."""
    misfits = []
    for alternative in _alternatives(kind):
        misfit = _misfit_of_one(value, alternative, name)
        if misfit is None:
            return None
        misfits.append(misfit)
    return next((misfit for misfit in misfits if misfit.place != name), Misfit(name, value))


def _misfit_of_one(value: Any, kind: Any, name: str) -> Misfit | None:
    """Return what is not of a kind that has no alternatives."""
    origin, inside = get_origin(kind), get_args(kind)
    misfit = Misfit(name, value)
    if kind in UNCHECKED or isinstance(kind, str | TypeVar) or origin is Literal:
        return None
    if origin is Callable:
        return None if callable(value) else misfit
    if _is_of_lists(kind):
        if isinstance(value, str) and str in _alternatives(inside[0]):
            return None  # a text alone stands for a list of it
        if not _is_row(value, len(inside) if origin is tuple else None, origin is Collection):
            return misfit
        if float in _alternatives(inside[0]) and all(type(entry) is float for entry in value):
            return None  # thousands of floats need no closer look
        return _first(_misfit(entry, inside[0], f"{name}[{place}]") for place, entry in enumerate(value))
    if origin is not None:
        if not isinstance(value, Mapping):
            return misfit
        keys = (_misfit(key, str, f"a key of {name}") for key in value)
        return _first(keys) or _first(_misfit(entry, inside[1], f"{name}[{key!r}]") for key, entry in value.items())
    if kind is not bool and isinstance(value, bool):
        return misfit
    return None if isinstance(value, STAND_INS.get(kind, kind)) else misfit


def _first(misfits: Iterable[Misfit | None]) -> Misfit | None:
    return next((misfit for misfit in misfits if misfit is not None), None)


def _is_row(value: object, count: int | None, any_order: bool) -> bool:
    """Return whether a value has entries in an order, and so many of them if a count is given.

    Args:
        value: the argument.
        count: number of entries that it must have; None for any number.
        any_order: whether sets, which have no order, are taken as well.
    """
    if not isinstance(value, Iterable) or isinstance(value, str | bytes | Mapping):
        return False
    if getattr(value, "shape", None) == ():  # an array of no dimension says that it can be iterated, and cannot
        return False
    return (any_order or not isinstance(value, Set)) and (count is None or len(list(value)) == count)


def _alternatives(kind: Any) -> tuple[Any, ...]:
    """Return the alternatives of an annotation."""
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _is_of_lists(kind: Any) -> bool:
    """Return whether an annotation asks for a row of entries."""
    return get_origin(kind) in (Sequence, Collection, Iterable, tuple)
