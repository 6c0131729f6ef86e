"""The scalars of a machine by path ("geometry.base_radius", "stiffness.passive_links.0"): list, find, replace.

Numbers that are hardly what was meant are pointed out here too (`doubts`); what is refused is up to `spec`.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from operator import itemgetter
from typing import Any, NamedTuple, Protocol, TypeVar

from kinetostat.algebra.scalar import Scalar
from kinetostat.frozen import dataclass
from kinetostat.machine.column import column
from kinetostat.spec.errors import InputError, nearest, shorten
from kinetostat.spec.fields import Quantity, leaves, quantities
from kinetostat.units import KINDS, RIGID, UnitError

LONGEST_NAME = 40
"""Characters of a name that people choose and that stands in paths: a row on the terminal has room for it."""
KEPT_FAMILIES = 64
"""Families that caches keep, so that machines with one plan share parameters, tables and compiled programs."""
FULL_TURN = 2.0 * math.pi * (1.0 + 1e-9)
"""Greatest plausible angle, rad: a turn with the round-off of degrees."""
MOST_TIMES = 100.0
"""Greatest plausible ratio of a length to the longest of all others: m in the place of mm make it a thousand."""
CONTRAST = 1e22
"""Factor by which stiffnesses of one machine may differ, in SI: from 1e24 on round-off hides the stiffer."""
SOFTEST_PLAUSIBLE = 100.0
"""N/m: a part that deflects by 10 mm under 1 N can be neither a drive nor a link of a machine."""


class HasFields(Protocol):
    """A family as this module sees it: tables of fields under a name."""

    @property
    def name(self) -> str:
        """As written in machine files."""

    @property
    def every_table(self) -> dict[str, type]:
        """Classes of its tables by name."""


class HasNumbers(Protocol):
    """A machine as this module sees it: a family with numbers in its tables. `machine.machine` imports this module."""

    @property
    def family(self) -> Any:
        """Its kind."""

    @property
    def tables(self) -> Mapping[str, Any]:
        """One instance for each table of the family."""

    def configure(self) -> Any:
        """The machine at its pose."""


AnyMachine = TypeVar("AnyMachine", bound=HasNumbers)


@dataclass(frozen=True)
class Parameter:
    """A field of a machine file, or one entry of a field that holds several.

    Attributes:
        path: the path as people write it.
        quantity: kind, meaning and bounds of its values.
        leaves: paths of the scalars it stands for: one, or every entry of the field together.
    """

    path: str
    quantity: Quantity
    leaves: tuple[str, ...]

    @property
    def shown(self) -> str:
        """Its name for people; see `shown`."""
        return shown(self.path)

    @property
    def unit(self) -> str:
        """The SI unit of its values, as people read it."""
        return KINDS[self.quantity.kind].unit

    @property
    def dimension(self) -> str:
        """Its name in datasets; see `dimension`."""
        return dimension(self.path)


AXES = ("x", "y", "z")
"""Names of the entries of a vector."""
VECTORS = (
    "offset", "moment", "force", "gravity", "gravity_axis", "centre_of_mass", "payload_centre", "point", "axis",
    "first_axis", "second_axis", "far", "direction",
)  # fmt: skip
"""Fields whose entries are along x, y, z."""
TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Names of the entries of an inertia tensor."""
TENSORS = ("inertia", "payload_inertia")
"""Fields that are inertia tensors."""


def names_entries(field: str) -> bool:
    """Return whether the entries of a field have names: those of a vector and of an inertia tensor have."""
    return field in VECTORS or field in TENSORS


def entry_name(field: str, entry: int) -> str:
    """Return the name of an entry, counted from 0: x, y or z of a vector, xx of a tensor, else its number from 1."""
    if field in TENSORS:
        return TENSOR[entry]
    return AXES[entry] if field in VECTORS else str(entry + 1)


def numbered_entry(text: str) -> str:
    """Return a path with the number of an entry that was named by its axes: "load.force.0" of "load.force.x"."""
    field, _, entry = text.rpartition(".")
    last = field.rpartition(".")[2]
    names = TENSOR if last in TENSORS else AXES if last in VECTORS else ()
    return f"{field}.{names.index(entry)}" if entry in names else text


def named_entry(path: str) -> str:
    """Return a path with the name of an entry of a vector or a tensor: "load.force.x" of "load.force.0"."""
    field, _, entry = path.rpartition(".")
    last = field.rpartition(".")[2]
    return f"{field}.{entry_name(last, int(entry))}" if entry.isdecimal() and names_entries(last) else path


POSE = "pose."
"""Beginning of the paths of coordinates of the pose."""


def shown(path: str) -> str:
    """Return a path as people read it: coordinates of the pose by their names alone (x), entries by their axes."""
    return named_entry(path.removeprefix(POSE))


def data_name(path: str) -> str:
    """Return a path as CSV files and datasets name it, with the numbers of entries: x, load.force.2."""
    return path.removeprefix(POSE)


def dimension(path: str) -> str:
    """Return the name of a field in datasets, which has no dots and so can be an attribute: x, geometry_base_angle."""
    return data_name(path).replace(".", "_")


def parameters(family: HasFields) -> tuple[Parameter, ...]:
    """All parameters of a family: every field, and every entry of fields that hold several."""
    return _parameters(tuple(family.every_table.items()))


@lru_cache(KEPT_FAMILIES)
def _parameters(tables: tuple[tuple[str, type], ...]) -> tuple[Parameter, ...]:
    known = []
    for table, fields in tables:
        for name, quantity in quantities(fields).items():
            paths = tuple(leaves(f"{table}.{name}", quantity))
            known.append(Parameter(f"{table}.{name}", quantity, paths))
            if quantity.count is not None:
                known += [Parameter(path, quantity, (path,)) for path in paths]
    return tuple(known)


@lru_cache(1024)
def _scalars_of(table: str, fields: type) -> tuple[tuple[str, bool, tuple[str, ...]], ...]:
    """Return each field of a table: its name, whether it holds one scalar, and the paths of its scalars.

    Every state, law and search reads all scalars of its machine again and again; to write their paths each time would
    take most of it.
    """
    known = quantities(fields).items()
    return tuple((name, q.count is None, tuple(leaves(f"{table}.{name}", q))) for name, q in known)


def find(family: HasFields, text: str) -> Parameter:
    """The parameter people mean: its path, its name in tables or datasets, or the end of its path if no other ends so.

    Args:
        family: the family of the machine.
        text: "x", "pose.x", "geometry.base_angles.1", "geometry_base_angles_1" or "base_angles.1"; entries of
            vectors and inertia tensors also by their axes, "force.x".

    Raises:
        InputError: none, several, or several numbers that are never alike; the message lists what is near.
    """
    matches = find_field(family, text)
    if matches.quantity.apart and len(matches.leaves) > 1:
        raise InputError(
            f"{matches.shown} holds {len(matches.leaves)} numbers; name one of them: {', '.join(matches.leaves)}."
        )
    return matches


def find_field(family: HasFields, text: str) -> Parameter:
    """The field people mean, as in `find`, also one with several numbers that are never alike.

    Raises:
        InputError: there is no such field, or several; the message lists what is near.
    """
    known = {parameter.path: parameter for parameter in parameters(family)}
    as_written, text = text, numbered_entry(text)
    for exact in (text, f"{POSE}{text}"):
        if exact in known:
            return known[exact]
    ends = [path for path in known if path.endswith(f".{text}") or known[path].dimension == text]
    if len(ends) == 1:
        return known[ends[0]]
    if ends:
        raise InputError(f'"{text}" may mean {" or ".join(ends)}; write one of them.')
    near = nearest(text, [*known, *(path.split(".", 1)[1] for path in known)])
    pose = ", ".join(shown(path) for path in known if path.startswith(POSE))
    rest = f"coordinates of its pose are {pose}, and `kinetostat check` shows every field."
    advice = f"did you mean {named_entry(near)}?" if near else rest
    raise InputError(f"{shorten(as_written)} is not a field of family {family.name}; {advice}")


def values(machine: HasNumbers) -> dict[str, Scalar]:
    """Every scalar of a machine by path, SI."""
    scalars: dict[str, Scalar] = {}
    for table, fields in machine.family.every_table.items():
        numbers = machine.tables[table]
        for name, single, paths in _scalars_of(table, fields):
            if single:
                scalars[paths[0]] = getattr(numbers, name)
            else:
                scalars.update(zip(paths, getattr(numbers, name), strict=True))
    return scalars


def with_values(machine: AnyMachine, changes: Mapping[str, Any]) -> AnyMachine:
    """The machine with some scalars replaced, by leaf path: by floats, traced scalars or arrays (as columns)."""
    new = {**values(machine), **{path: column(value) for path, value in changes.items()}}
    tables = {}
    for table, fields in machine.family.every_table.items():
        numbers = {
            name: new[paths[0]] if single else tuple([new[path] for path in paths])
            for name, single, paths in _scalars_of(table, fields)
        }
        tables[table] = fields(**numbers)
    new_machine: Any = machine
    return replace(new_machine, tables=tables)


Given = float | str | Iterable[float | str] | Iterable[Iterable[float]] | Mapping[str, float | str]
"""A value as people give it: SI, or text with a unit; of a field with several entries, one for all or one for each; a
matrix or a table for an orientation (`machine.orientation`)."""


def read_numbers(family: HasFields, given: Mapping[str, Given]) -> dict[str, float]:
    """Read values of fields, each checked by itself: SI by leaf path.

    Args:
        family: the family whose fields they are.
        given: values by name of the field, as `find` takes it.

    Raises:
        InputError: an unknown field, a value that is none or out of bounds, or a list of another length than the field.
    """
    numbers: dict[str, float] = {}
    for name, written in given.items():
        # Numbers and arrays of NumPy become those of Python.
        value = written.tolist() if hasattr(written, "tolist") else written
        if isinstance(value, str) or not isinstance(value, Iterable):
            parameter = find(family, name)
            numbers.update(dict.fromkeys(parameter.leaves, read_number(parameter, value)))
            continue
        parameter, entries = find_field(family, name), list(value)
        if len(entries) != len(parameter.leaves):
            allowed = f"{len(parameter.leaves)} values" if len(parameter.leaves) > 1 else "one value"
            raise InputError(f"{parameter.shown} is {shorten(entries)}; give {allowed}.")
        pairs = zip(parameter.leaves, entries, strict=True)
        numbers.update((leaf, read_number(parameter, entry, leaf)) for leaf, entry in pairs)
    return numbers


def read_number(parameter: Parameter, value: object, path: str = "") -> float:
    """Read one value of a field, SI; `path` names one entry of several.

    Raises:
        InputError: it is not a quantity of this kind, or one that the field does not allow.
    """
    quantity, name = parameter.quantity, shown(path or parameter.path)
    if isinstance(value, str) and quantity.unset is not None and value.strip().lower() == quantity.show(quantity.unset):
        return quantity.unset
    if isinstance(value, float) and (value == quantity.unset or (quantity.stiff and value == math.inf)):
        return value
    try:
        return quantity.number(value)
    except UnitError as error:
        written = quantity.show(value) if isinstance(value, float) and math.isfinite(value) else shorten(value)
        raise InputError(f"{name} is {written}: {error}.") from None


def with_leg(machine: HasNumbers, path: str) -> str:
    """Return a path for people, as entries count from 0: "geometry.base_angles.5 (leg 6)", "tool.inertia.0 (xx)"."""
    field, _, entry = path.rpartition(".")
    last = field.rpartition(".")[2]
    if entry.isdecimal() and names_entries(last):
        return f"{path} ({entry_name(last, int(entry))})"
    whole = next((p for p in parameters(machine.family) if p.path == field and p.quantity.per_leg), None)
    if whole is None:
        return path
    names = {leg.number: leg.name for leg in machine.configure().legs}
    return f"{path} ({names.get(int(entry) + 1, f'leg {int(entry) + 1}')})"


def check_contrast(machine: HasNumbers, origin: str) -> None:
    """Refuse stiffnesses so far apart that double precision cannot tell the stiffest one from a rigid one.

    Args:
        machine: the machine with numbers; those that are free or rigid are exact beside any others.
        origin: names it in messages.

    Raises:
        InputError: names the softest and the stiffest.
    """
    numbers = values(machine)
    elastic = [
        (float(numbers[leaf]), leaf, parameter)
        for parameter in parameters(machine.family)
        if parameter.quantity.stiff
        for leaf in parameter.leaves
        if 0.0 < float(numbers[leaf]) < math.inf
    ]
    if not elastic:
        return
    (soft, softest, low), (hard, stiffest, high) = (extreme(elastic, key=itemgetter(0)) for extreme in (min, max))
    if hard > CONTRAST * soft:
        raise InputError(
            f'"{origin}": {softest} is {low.quantity.show(soft)} and {stiffest} {high.quantity.show(hard)}; '
            f"stiffnesses of one machine may differ by a factor of {CONTRAST:g} at most: write 0 for what is free, "
            f'"{RIGID}" for what is rigid.'
        )


def doubts(machine: HasNumbers) -> Iterator[str]:
    """A sentence for each implausible number: an angle beyond a turn, one length beyond all, no stiffness."""
    numbers = list(_finite_numbers(machine))
    lengths = [number for number in numbers if number.kind == "length"]
    for path, field, kind, value in numbers:
        if kind == "angle" and abs(value) > FULL_TURN:
            yield f'{path} is {value:g} rad, more than a turn; if degrees are meant, write "{value:g} deg".'
        if kind == "length":
            longest = max((abs(other.value) for other in lengths if other.field != field), default=0.0)
            if 0.0 < MOST_TIMES * longest < abs(value):
                advice = f'if mm are meant, write "{value:g} mm".'
                yield f"{path} is {value:g} m, over {MOST_TIMES:g} times all others; {advice}"
        if kind == "linear stiffness" and 0.0 < value < SOFTEST_PLAUSIBLE:
            yield f'{path} is {value:g} N/m, next to nothing; if N/um are meant, write "{value:g} N/um".'


class _FiniteNumber(NamedTuple):
    """A number of a machine, SI: its path, that of its field, and the kind of quantity."""

    path: str
    field: str
    kind: str
    value: float


def _finite_numbers(machine: HasNumbers) -> Iterator[_FiniteNumber]:
    """Give every finite number of a machine; once for all entries of a field that are alike."""
    scalars = values(machine)
    fields = {p.path: p for p in parameters(machine.family)}
    entries = {leaf for p in fields.values() if p.quantity.count for leaf in p.leaves}
    for field in (p for p in fields.values() if p.path not in entries):
        finite = {leaf: float(scalars[leaf]) for leaf in field.leaves if math.isfinite(scalars[leaf])}
        if len(set(finite.values())) == 1:
            finite = {field.path: next(iter(finite.values()))}
        yield from (_FiniteNumber(path, field.path, field.quantity.kind, value) for path, value in finite.items())
