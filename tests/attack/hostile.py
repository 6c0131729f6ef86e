"""Hostile input: machine, study and URDF files grown from the schema or spoilt from good ones, and command lines.

Everything is drawn from a `random.Random`, so that a number names a case for ever.
"""

import json
import math
import re
import string
import tomllib
from functools import cache
from random import Random
from typing import Any

from kinetostat.exchange.urdf_export import texts_of
from kinetostat.machine.file_schema import machine_schema
from kinetostat.machine.loading import bundled, load
from kinetostat.spec.study import study_schema
from kinetostat.studies.analysis import analyze
from kinetostat.studies.bundled import bundled_studies

NUMBERS = (
    0, 1, -1, 0.5, -0.0, 2, 3, 6, 7, 1e-3, 1e3, 1e-12, 1e12, 1e-300, 1e-320, 1e300, 1.7e308, -1e308, 2**53, 2**63,
    10**30, 9007199254740993, 0.1 + 0.2, math.pi, math.nan, math.inf, -math.inf,
)  # fmt: skip
UNITS = (
    "mm", "cm", "m", "deg", "rad", "N/m", "N/um", "N*m/rad", "kN", "N", "kg", "GPa", "m**2", "furlong", "°C", "degC",
    "1/s", "", "mm mm", "m/m", "percent", "%", "dB", "N/m**999", "kilo", "attoparsec", "m*" * 30 + "m",
)  # fmt: skip
WORDS = (
    "rigid", "free", "none", "inf", "nan", "-inf", "1e999", "True", "null", "", " ", "0x10", "1_000", "1,5", "1e5e5",
    "legs", "hexapod", "x", "pose.x", "geometry.base_radius", "..", "a.b.c.d", "__class__", "{x}", "%s", "${HOME}",
    "\x1b[31mred\x1b[0m", "\x7f", "\x00", "a\nb", "a\tb", "‮evil", "漢字", "é" * 40, "😀", "$a$ and $b$", "\\frac{1}{0}",
    "=1+1", "@SUM(A1)", "-cmd", "'; drop", "<script>alert(1)</script>", "../../etc/passwd", "A" * 200, "z" * 5000,
    "1979-05-27", "07:32:00", "one", "1 mm", "-1 mm", "1e400 mm", "12 deg", "999999999999999999999999 m", "[1, 2]",
)  # fmt: skip
DATES = ("1979-05-27", "1979-05-27T07:32:00Z", "07:32:00")
"""Values that TOML has and JSON has not; they are written bare."""
SHARE_HOSTILE = 0.01
"""How often a grown document takes a hostile value where the schema offers a good one."""
MEASURE = re.compile(r"([-+]?[0-9][0-9.]*(?:[eE][-+]?[0-9]+)?)( .+)")
"""A number and its unit, with the space between."""


LOADS = """
[tool]
mass = "3 kg"
centre_of_mass = [0, "10 mm", "20 mm"]
payload = "1 kg"
inertia = ["0.3 kg*m**2", "0.3 kg*m**2", "0.5 kg*m**2", 0, 0, "0.01 kg*m**2"]
payload_centre = [0, 0, "50 mm"]
payload_inertia = ["0.01 kg*m**2", "0.01 kg*m**2", "0.01 kg*m**2", 0, 0, 0]
[drives]
rotor_inertia = "2e-5 kg*m**2"
lead = "10 mm"
ratio = 30
[cutting]
pressure = "2000 N/mm**2"
direction = [1, 0, 0.5]
[damping]
per_mass = "2 1/s"
per_stiffness = "20 us"
hinges = "0.1 N*m*s/rad"
slides = "30 N*s/m"
[tolerances]
joints = ["0.05 mm", "sigma 0.02 deg"]
zeros = ["0.02 mm", "0.01 deg"]
gains = "20 um/m"
clearances = "5 um"
compliances = "10 %"
"legs.*" = ["IT7", "0.1 deg"]
[load]
state = "loaded"
force = ["20 N", 0, "-100 N"]
gravity = [0, 0, "-9.81 m/s**2"]
gravity_angle = "20 deg"
[load.spindle]
point = ["30 mm", 0, "-40 mm"]
force = [0, "10 N", 0]
"""
CABLES = """
schema = 1
name = "cables"
family = "legs"
space = "planar"
platform.point = [0, 0, 0]
pose = { x = "50 mm", y = 0, yaw = "5 deg" }
sections.bar = { shape = "round", diameter = "20 mm", material = "steel", temperature_rise = "9 K" }
load = { gravity = [0, "-9.81 m/s**2", 0], max_tension = "9 kN" }
tool = { mass = "8 kg" }
[[legs]]
name = "upper"
type = "cable"
copies = 2
mirrored = true
from = ["-1 m", "2 m", 0]
to = ["-1 m", "20 cm", 0]
stiffness = "200 N/mm"
preload = "100 N"
[[legs]]
name = "lower"
type = "cable"
from = ["1 m", "-2 m", 0]
to = ["1 m", "-20 cm", 0]
stiffness = "200 N/mm"
[[legs]]
name = "strut"
joints = [
  { name = "foot", type = "revolute", joins = ["base", "link"], point = ["-1 m", "-2 m", 0], axis = [0, 0, 1], stiffness = "90 N*m/rad", preload = "2 N*m" },
  { name = "slide", type = "prismatic", joins = ["link", "rod"], point = ["-1 m", "-1 m", 0], axis = "head", stiffness = "50 N/mm", actuated = true, acts = "pushes" },
  { name = "head", type = "revolute", joins = ["rod", "platform"], point = ["-1 m", "-20 cm", 0], axis = [0, 0, 1] },
]
links.link = { model = "rigid", section = "bar", mass = "2 kg", centre_of_mass = ["-1 m", "-1.5 m", 0] }
"""  # noqa: E501
"""What may load a machine, for bundled ones that say nothing about it, and a machine of cables."""


class Bare(str):
    """Text that stands in a TOML file without quotes."""


def number(rng: Random) -> Any:
    """A number, mostly an unusual one."""
    choice = rng.random()
    if choice < 0.6:
        return rng.choice(NUMBERS)
    return rng.uniform(-1, 1) * 10.0 ** rng.uniform(-9, 9) if choice < 0.95 else 10 ** rng.randrange(400)


def value(rng: Random, depth: int = 0) -> Any:
    """Anything that a TOML file can hold."""
    kind = rng.randrange(9 if depth < 3 else 6)
    if kind < 2:
        return number(rng)
    if kind == 2:
        return f"{number(rng)} {rng.choice(UNITS)}"
    if kind == 3:
        return rng.choice(WORDS)
    if kind == 4:
        return rng.choice((True, False))
    if kind == 5:
        return Bare(rng.choice(DATES))
    if kind == 6:
        return [value(rng, depth + 1) for _ in range(rng.choice((0, 1, 2, 3, 6, 7, 40)))]
    return {key(rng): value(rng, depth + 1) for _ in range(rng.choice((0, 1, 2, 5)))}


def key(rng: Random) -> str:
    """A key, mostly a known one."""
    return rng.choice(WORDS) if rng.random() < 0.2 else rng.choice(known_keys())


@cache
def known_keys() -> list[str]:
    """Every word that stands as a key in a bundled machine or study."""
    keys: set[str] = set()

    def collect(node: Any) -> None:
        if isinstance(node, dict):
            keys.update(node)
            for entry in node.values():
                collect(entry)
        elif isinstance(node, list):
            for entry in node:
                collect(entry)

    for text in good_texts("machine") + good_texts("study"):
        collect(tomllib.loads(text))
    return sorted(keys)


@cache
def good_texts(kind: str) -> list[str]:
    """Texts of all bundled machines or studies, of machines under load as well."""
    if kind == "study":
        return [*bundled_studies().values()]
    free = [*bundled().values()]
    under_load = [toml({**tomllib.loads(text), **tomllib.loads(LOADS)}) for text in free]
    return [*free, *under_load, CABLES]


@cache
def good_urdf() -> list[str]:
    """URDF files of two machines."""
    return [texts_of(analyze(load(name)))[0] for name in ("tripteron", "planar-3rpr")]


@cache
def schema(kind: str) -> dict[str, Any]:
    """The JSON Schema of machine or study files."""
    return machine_schema() if kind == "machine" else study_schema()


def toml(document: Any) -> str:
    """A document as TOML, a line for each key of the whole, tables inline; values need not be sensible."""
    return "\n".join(f"{_quoted(name)} = {_inline(entry)}" for name, entry in document.items()) + "\n"


def _quoted(name: str) -> str:
    plain = name and all(c in string.ascii_letters + string.digits + "_-" for c in name)
    return name if plain else _text(name)


def _text(text: str) -> str:
    return json.dumps(text).replace("\x7f", "\\u007f")


def _inline(entry: Any) -> str:
    if isinstance(entry, Bare):
        return str(entry)
    if isinstance(entry, bool):
        return str(entry).lower()
    if isinstance(entry, str):
        return _text(entry)
    if isinstance(entry, dict):
        return "{" + ", ".join(f"{_quoted(name)} = {_inline(item)}" for name, item in entry.items()) + "}"
    if isinstance(entry, list):
        return "[" + ", ".join(map(_inline, entry)) + "]"
    return repr(entry)


def grown(rng: Random, node: dict[str, Any], root: dict[str, Any], depth: int = 0) -> Any:
    """A value that the schema allows, but for a hostile one here and there."""
    if rng.random() < SHARE_HOSTILE:
        return value(rng, 1)
    if "$ref" in node:
        return grown(rng, root["$defs"][node["$ref"].rsplit("/", 1)[1]], root, depth)
    if "anyOf" in node:
        return grown(rng, rng.choice([n for n in node["anyOf"] if n.get("type") != "null"]), root, depth)
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return rng.choice(node["enum"])
    if node.get("examples"):
        return rng.choice(node["examples"])
    kind = node.get("type", "string")
    kind = rng.choice(kind) if isinstance(kind, list) else kind
    if kind == "object":
        return _object(rng, node, root, depth)
    if kind == "array":
        low = node.get("minItems", 0)
        high = min(node.get("maxItems", low + 3), low + 3)
        count = rng.randint(low, high) if rng.random() > 0.05 else rng.randrange(9)
        return [grown(rng, node.get("items", {}), root, depth + 1) for _ in range(count if depth < 6 else 0)]
    if kind in ("number", "integer"):
        return rng.choice((0, 1, 2, 0.1, 0.5, 1000)) if rng.random() < 0.7 else number(rng)
    return rng.choice(WORDS) if rng.random() < 0.3 else f"{rng.choice((1, 5, 12, 0.3))} {rng.choice(UNITS[:10])}"


def _object(rng: Random, node: dict[str, Any], root: dict[str, Any], depth: int) -> dict[str, Any]:
    required = set(node.get("required", ()))
    wanted = [n for n in node.get("properties", {}) if n in required or rng.random() < 0.3]
    wanted = [name for name in wanted if rng.random() > 0.01]
    made = {name: grown(rng, node["properties"][name], root, depth + 1) for name in wanted}
    more = node.get("additionalProperties")
    if isinstance(more, dict) and depth < 6:
        made.update({key(rng): grown(rng, more, root, depth + 1) for _ in range(rng.randrange(3))})
    if rng.random() < 0.03:
        made[key(rng)] = value(rng, 2)
    return made


def spoilt(rng: Random, text: str) -> str:
    """A good file with odd numbers, or with one to four changes in its tables or its letters."""
    spoil = rng.choice((_odd_numbers, _odd_numbers, _odd_numbers, _spoilt_tables, _spoilt_tables, _spoilt_letters))
    return spoil(rng, text)


def _odd_numbers(rng: Random, text: str) -> str:
    """Keep every field and its unit, and change one to five numbers: to odd ones, to those of others, or by little."""
    document = tomllib.loads(text)
    places = [(holder, name) for holder, name in entries_of(document) if _number_in(holder[name]) is not None]
    numbers = [_number_in(holder[name]) for holder, name in places]
    for at in rng.sample(range(len(places)), min(len(places), rng.choice((1, 1, 1, 2, 5)))):
        holder, name = places[at]
        near = numbers[at] * rng.choice((1.0 + 1e-9, 1.1, 0.5, 2.0, -1.0, 10.0, 0.0))
        new = rng.choice((near, near, rng.choice(numbers), rng.choice(NUMBERS)))
        holder[name] = f"{new!r}{MEASURE.fullmatch(holder[name])[2]}" if isinstance(holder[name], str) else new
    return toml(document)


def _number_in(entry: Any) -> float | None:
    """The number of a value with or without a unit; None where there is none."""
    if isinstance(entry, str):
        match = MEASURE.fullmatch(entry)
        entry = float(match[1]) if match else None
    return float(entry) if isinstance(entry, int | float) and not isinstance(entry, bool) else None


def _spoilt_tables(rng: Random, text: str) -> str:
    document = tomllib.loads(text)
    for _ in range(rng.randint(1, 4)):
        places = [*entries_of(document)]
        holder, name = rng.choice(places)
        action = rng.random()
        if action < 0.6:
            holder[name] = value(rng)
        elif action < 0.75:
            del holder[name]
        elif action < 0.9 and isinstance(holder, dict):
            holder[key(rng)] = value(rng)
        else:
            holder[name] = copied(rng.choice(places)[0])
        if not document:
            break
    return toml(document)


def entries_of(node: Any) -> Any:
    """Every entry of tables and lists in each other: what holds it, and its name or number there."""
    for name, entry in node.items() if isinstance(node, dict) else enumerate(node):
        yield node, name
        if isinstance(entry, dict | list):
            yield from entries_of(entry)


def copied(node: Any) -> Any:
    """A copy of tables and lists in each other: a table that stood in itself would have no end."""
    if isinstance(node, dict):
        return {name: copied(entry) for name, entry in node.items()}
    return [copied(entry) for entry in node] if isinstance(node, list) else node


def _spoilt_letters(rng: Random, text: str) -> str:
    letters = [*text]
    for _ in range(rng.randint(1, 6)):
        at, many = rng.randrange(max(len(letters), 1)), rng.choice((1, 1, 1, 3, 30))
        action = rng.randrange(4)
        if action == 0:
            del letters[at : at + many]
        elif action == 1:
            letters[at:at] = [*rng.choice(WORDS)]
        elif action == 2:
            letters[at : at + 1] = [chr(rng.choice((0, 7, 10, 27, 34, 39, 91, 93, 127, 233, 0x202E, 0x6F22)))]
        else:
            letters[at:at] = letters[max(0, at - many) : at] * rng.choice((1, 2, 50))
    return "".join(letters)


def file(rng: Random, kind: str) -> str:
    """A hostile machine, study or URDF file."""
    if kind == "urdf":
        return spoilt_xml(rng, rng.choice(good_urdf()))
    return toml(grown_whole(rng, kind)) if rng.random() < 0.3 else spoilt(rng, rng.choice(good_texts(kind)))


def grown_whole(rng: Random, kind: str) -> dict[str, Any]:
    """A document from the schema alone."""
    made = grown(rng, schema(kind), schema(kind))
    return made if isinstance(made, dict) else {key(rng): made}


def spoilt_xml(rng: Random, text: str) -> str:
    """A URDF with attributes exchanged, elements doubled or dropped, or letters changed."""
    if rng.random() < 0.3:
        return _spoilt_letters(rng, text)
    lines = text.splitlines()
    for _ in range(rng.randint(1, 4)):
        at, action = rng.randrange(len(lines)), rng.randrange(3)
        if action == 0:
            lines[at:at] = [lines[rng.randrange(len(lines))]]
        elif action == 1:
            del lines[at]
        else:
            parts = lines[at].split('"')
            if len(parts) > 2:
                parts[2 * rng.randrange(len(parts) // 2) + 1] = str(rng.choice((*WORDS, number(rng), "0 0 0", "1 0 0")))
                lines[at] = '"'.join(parts)
    return "\n".join(lines)
