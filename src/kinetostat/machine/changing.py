"""A machine with other numbers, checked as its file would be. Reads and writes no file."""

from collections.abc import Mapping
from dataclasses import replace

from kinetostat.machine.loading import as_toml, build
from kinetostat.machine.machine import Machine
from kinetostat.machine.orientation import form_of
from kinetostat.machine.parameters import Given, find_field
from kinetostat.spec.arguments import checked
from kinetostat.spec.document import parse

INDEPENDENT = ("pose", "tool", "load")
"""Tables whose numbers need only be checked by themselves."""


@checked
def changed(machine: Machine, values: Mapping[str, Given]) -> Machine:
    """The machine with some fields, or entries of fields, at other values, checked as a file would be.

    Of the same family, so that what has been compiled for it is used again.

    Args:
        machine: which stays as it is.
        values: by name of the field, in SI or as text with a unit; for a field with several entries one for all, or a
            list or array of one for each; infinity is "rigid".

    Raises:
        InputError: an unknown field, no quantity, a value out of bounds, a list of the wrong length, or numbers that
            contradict each other.
    """
    new = machine.with_values(values)
    return rebuilt(new) if any(related(machine, name) for name in values) else new


def related(machine: Machine, path: str) -> bool:
    """Whether a field is checked against others: then `rebuilt` has the last word on a change."""
    if form_of(path):
        return False
    parameter = find_field(machine.family, path)
    table = parameter.path.split(".")[0]
    written = machine.family.chains is not None and not parameter.quantity.stiff
    return table == "limits" or (written and table not in INDEPENDENT)


def rebuilt(machine: Machine) -> Machine:
    """The machine as read from its own file, with every check that a file undergoes; takes some 50 ms leg by leg.

    Raises:
        InputError: its numbers contradict each other.
    """
    again = build(parse(as_toml(machine), machine.name), machine.name)
    return replace(again, written=machine.written)
