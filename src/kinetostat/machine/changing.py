"""A machine with other numbers, checked as its file would be. Reads and writes no file."""

from collections.abc import Mapping

from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine, need_machine
from kinetostat.machine.parameters import find, with_values
from kinetostat.spec.document import parse as parse_document
from kinetostat.spec.errors import InputError, shorten
from kinetostat.spec.fields import Quantity
from kinetostat.units import UnitError, parse

INDEPENDENT = ("pose", "tool", "load")
"""Tables whose numbers need only be checked by themselves."""


def read_value(machine: Machine, path: str, text: str) -> float:
    """The SI value that people wrote for a field, or for one entry of it.

    Raises:
        InputError: no such field, no quantity, or one that the field does not allow.
    """
    parameter = find(machine.family, path)
    return _read(parameter.path, parameter.quantity, text)


def changed(machine: Machine, values: Mapping[str, float | str]) -> Machine:
    """The machine with some fields, or entries of fields, at other values, each checked by itself.

    Cheap, and of the same family, so that what has been compiled for it is used again.

    Args:
        machine: which stays as it is.
        values: by path, in SI or as text with a unit.

    Raises:
        InputError: an unknown field, no quantity, or a value out of bounds.
    """
    need_machine(machine)
    leaves: dict[str, float] = {}
    for path, given in values.items():
        parameter = find(machine.family, path)
        if isinstance(given, list | tuple):
            raise InputError(f"{path} is {shorten(given)}; give one value for each path, as {parameter.leaves[0]}.")
        value = read_value(machine, path, given) if isinstance(given, str) else given
        _check(parameter.path, parameter.quantity, value)
        leaves.update(dict.fromkeys(parameter.leaves, value))
    return with_values(machine, leaves)


def related(machine: Machine, path: str) -> bool:
    """Whether a field is checked against others: then `rebuilt` has the last word on a change."""
    parameter = find(machine.family, path)
    table = parameter.path.split(".")[0]
    written = machine.family.chains is not None and not parameter.quantity.stiff
    return table == "limits" or (written and table not in INDEPENDENT)


def rebuilt(machine: Machine) -> Machine:
    """The machine as read from its own file, with every check that a file undergoes; takes some 50 ms leg by leg.

    Raises:
        InputError: its numbers contradict each other.
    """
    return build(parse_document(as_toml(machine), machine.name), machine.name)


def _read(path: str, quantity: Quantity, text: str) -> float:
    if quantity.unset is not None and text.strip().lower() == quantity.show(quantity.unset):
        return quantity.unset
    try:
        value = parse(text, quantity.kind)
    except UnitError as error:
        raise InputError(f"{path} is {shorten(text)}: {error}.") from None
    _check(path, quantity, value)
    return value


def _check(path: str, quantity: Quantity, value: float) -> None:
    if quantity.unset is not None and value == quantity.unset:
        return
    try:
        quantity.check(value)
    except UnitError as error:
        raise InputError(f"{path} is {quantity.show(value)}: {error}.") from None
