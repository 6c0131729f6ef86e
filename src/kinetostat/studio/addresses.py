"""The address of a page of the studio: the text that opens a machine at the same pose, and what it stands for.

    ?machine=hexapod&pose.z=0.21 m          a bundled machine with changes
    ?file=eNpt...&pose.z=0.21 m             any other, as a compressed file

An address is text from anywhere, and is checked like a file.
"""

import base64
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from urllib.parse import quote, urlencode

from kinetostat.machine.common_tables import STATES
from kinetostat.machine.loading import as_toml, build, bundled, changed, load, read_again
from kinetostat.machine.machine import Machine
from kinetostat.machine.parameters import parameters, values
from kinetostat.spec.document import LARGEST_FILE
from kinetostat.spec.errors import InputError, choice
from kinetostat.studio.session import Memory

MACHINE_KEY, FILE_KEY = "machine", "file"
"""Keys of a bundled machine's name, and of a compressed machine file."""
STATE_KEY = "load.state"
"""Key of the state in which the machine is shown, if that is not the one of its file."""
LONGEST_ADDRESS = 8000
"""Characters of an address; browsers and servers take some more. A machine that needs more has no link."""


def address_of(memory: Memory) -> str:
    """Return the query of the address of a page, without the question mark; empty if it would be too long."""
    origin, machine = memory.origin, memory.now or memory.origin
    if origin.name != machine.name or origin.family.literals != machine.family.literals:
        origin = machine
    bundled_origin = memory.name and origin is memory.origin
    start = (MACHINE_KEY, memory.name) if bundled_origin else (FILE_KEY, _packed_text(as_toml(origin)))
    state = [] if origin.loaded is machine.loaded else [(STATE_KEY, machine.state)]
    query = urlencode([start, *state, *_changes(origin, machine)], quote_via=quote, safe="/*")
    return query if len(query) <= LONGEST_ADDRESS else ""


def _changes(origin: Machine, machine: Machine) -> Iterator[tuple[str, str]]:
    """List the fields, or entries of fields, that differ, and their values as text that gives them back exactly."""
    before, after, done = values(origin), values(machine), set[str]()
    for parameter in parameters(machine.family):  # a field of several comes before its entries
        leaves = [leaf for leaf in parameter.leaves if leaf not in done]
        alike = len({after[leaf] for leaf in parameter.leaves}) == 1
        if alike and any(after[leaf] != before[leaf] for leaf in leaves):
            done.update(leaves)
            yield parameter.path, parameter.quantity.show(after[leaves[0]])


def memory_of(query: Iterable[tuple[str, str]]) -> Memory:
    """Return the state that an address stands for.

    Args:
        query: its keys and values.

    Raises:
        InputError: it names no machine, or the machine or a change of it has a mistake.
    """
    (key, text), *changes = [*query] or [("", "")]
    if key == MACHINE_KEY:
        choice(text, bundled(), f"{MACHINE_KEY} in the address")
        name, origin = text, load(text)
    elif key == FILE_KEY:
        name, origin = "", build(_unpacked_text(text), "the machine in the address")
    else:
        raise InputError(f"the address names no machine; it must begin with ?{MACHINE_KEY}=... or ?{FILE_KEY}=... .")
    if not changes:
        return Memory(origin, name)
    numbers = dict(changes)
    state = choice(numbers.pop(STATE_KEY, origin.state), STATES, f"{STATE_KEY} in the address")
    return Memory(origin, name, read_again(replace(changed(origin, numbers), loaded=STATES[state])))


def _packed_text(text: str) -> str:
    return base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode().rstrip("=")


def _unpacked_text(packed: str) -> str:
    """Return the text of a file in an address; a limit keeps a short address from becoming a large text."""
    try:
        data = base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4))
        reader = zlib.decompressobj()
        text = reader.decompress(data, LARGEST_FILE)
        if reader.eof:
            return text.decode("utf-8")
    except (ValueError, zlib.error):
        pass
    raise InputError(
        f"the machine file in the address is damaged or too large; copy the whole address after ?{FILE_KEY}= ."
    )
