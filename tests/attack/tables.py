"""Hostile CSV files of poses and measurements, and records of fits: good ones of a small machine, spoilt.

Everything is drawn from a `random.Random`, as in `hostile`.
"""

import csv
import io
import json
import math
import tempfile
import tomllib
from functools import cache
from pathlib import Path
from random import Random

from hostile import LOADS, NUMBERS, UNITS, WORDS, entries_of, toml

from kinetostat.machine.loading import bundled, load
from kinetostat.studies.identification.identification import identify
from kinetostat.views.data_forms import json_of
from kinetostat.views.identification import IDENTIFICATION

MACHINE = "planar-3rpr"
"""Small, so that a fit takes no time."""
POSES = 12
POSE = ("x [mm]", "y [mm]", "angle [deg]")
COLUMNS = (
    *POSE, "actuator.leg 1 [mm]",
    "measured.x [mm]", "measured.y [mm]", "measured.rz [mrad]", "measured.z", "measured.yaw",
    "measured.distance [mm]", "from.x [mm]", "from.y [mm]", "from.z [mm]", "deflection.x [um]", "deflection.rz [urad]",
    "force.x [N]", "moment.z [N*m]", "sigma.x [um]", "sigma.deflection.x [um]", "sigma.rz", "geometry.base_radius [mm]",
    "stiffness.actuator [N/um]", "status", "quaternion.w", "time", "entry", "value", "sigma",
)  # fmt: skip
ENTRIES = ("stiffness_x", "stiffness_x_y", "stiffness_rz", "compliance_y", "free_stiffness_x", "compliance_z", "K")
PARTS = (
    "\x00",
    "\ufeff",
    '"',
    '""',
    ",",
    ";",
    "\t",
    "\r",
    "\u2028",
    "\x1b",
    "1" * 140_000,
    "," * 3000,
    "#",
    "=1+1",
    "1e308",
    "inf",
)
"""What is put somewhere between two letters."""


def table(rng: Random) -> str:
    """A hostile CSV file: of poses and what was measured there, or of the entries of a stiffness."""
    rows = _stiffness(rng) if rng.random() < 0.2 else _measured(rng)
    for _ in range(rng.choice((0, 1, 1, 2, 5))):
        _spoil(rng, rows)
    out = io.StringIO()
    separator = rng.choice(",,,,;\t")
    csv.writer(out, delimiter=separator, lineterminator=rng.choice(("\n", "\n", "\r\n", "\r"))).writerows(rows)
    text = out.getvalue()
    for _ in range(rng.choice((0, 0, 1, 3))):
        at = rng.randrange(len(text) + 1)
        text = text[:at] + rng.choice(PARTS) + text[at + rng.choice((0, 0, 1, 40)) :]
    if rng.random() < 0.03:
        text = rng.choice(
            ("", "\n\n", text[: rng.randrange(len(text) + 1)], text.splitlines()[0] if text else "", text * 1200)
        )
    return text


def _measured(rng: Random) -> list[list[str]]:
    more = rng.sample(COLUMNS, rng.choice((0, 0, 1, 3, 8)))
    heads = [*POSE, "measured.x [mm]", "measured.y [mm]", *more] if rng.random() < 0.8 else more or [*POSE]
    return [heads, *([_cell(rng, head) for head in heads] for _ in range(POSES))]


def _cell(rng: Random, head: str) -> str:
    """A number about where the machine is at home, in the unit of its head."""
    if head.startswith("sigma"):
        return f"{rng.uniform(1.0, 9.0):.3f}"
    name = head.partition(" ")[0].removeprefix("measured.")
    spread = 2.0 if name in ("x", "y") else 1.0
    return f"{rng.uniform(-spread, spread):.4f}"


def _stiffness(rng: Random) -> list[list[str]]:
    units = ("N/um", "um/N", "N*m/urad", "", rng.choice(UNITS))
    entries = rng.sample(ENTRIES, rng.randint(1, len(ENTRIES)))

    def size() -> str:
        return f"{rng.uniform(0.1, 50.0):.3g} {rng.choice(units)}"

    return [["entry", "value", "sigma"], *([name, size(), rng.choice(("3 %", "", size()))] for name in entries)]


def _spoil(rng: Random, rows: list[list[str]]) -> None:
    """Change a cell, a row or a column."""
    row = rng.choice(rows)
    action = rng.randrange(7)
    if not row or action == 0:
        rows.insert(rng.randrange(len(rows) + 1), [_entry(rng) for _ in range(rng.randrange(9))])
    elif action < 4:
        row[rng.randrange(len(row))] = _entry(rng)
    elif action == 4:
        rows[0][rng.randrange(len(rows[0]))] = rng.choice(COLUMNS) if rows[0] else ""
    elif action == 5:
        number = rng.choice(NUMBERS)
        for line in rows[1:]:
            line[-1:] = [str(number)]
    else:
        del row[rng.randrange(len(row))]


def _entry(rng: Random) -> str:
    return rng.choice((str(rng.choice(NUMBERS)), f"{rng.choice(NUMBERS)} {rng.choice(UNITS)}", rng.choice(WORDS), ""))


@cache
def good_table() -> str:
    """Measurements that can be fitted."""
    rng, out = Random("good"), io.StringIO()
    heads = [*POSE, "measured.x [mm]", "measured.y [mm]", "measured.rz [mrad]"]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heads)
    for _ in range(POSES):
        x, y, yaw = (rng.uniform(-9.0, 9.0) for _ in POSE)
        near = (x, y, yaw * math.pi / 0.18)
        writer.writerow(f"{number + rng.gauss(0.0, 1e-3):.5f}" for number in (x, y, yaw, *near))
    return out.getvalue()


GOOD_ENTRIES = "entry,value,sigma\nstiffness_x,20 N/um,3 %\ncompliance_y,0.05 um/N,2 %\n"
"""A stiffness as measured."""


def good_machine() -> str:
    """The machine with all that vibrations, tolerances and loads need."""
    return toml({**tomllib.loads(bundled()[MACHINE]), **tomllib.loads(LOADS)})


@cache
def good_record() -> str:
    """The record of a fit to them."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "measured.csv")
        path.write_text(good_table())
        return json.dumps(json_of(IDENTIFICATION, identify(load(MACHINE), path, ["zeros", "gains"])))


def record(rng: Random) -> str:
    """A hostile record of a fit."""
    document = json.loads(good_record())
    for _ in range(rng.choice((0, 1, 1, 3))):
        holder, name = rng.choice([*entries_of(document)])
        holder[name] = rng.choice((*NUMBERS, *WORDS, None, [], {}))
    text = json.dumps(document)
    if rng.random() < 0.3:
        at = rng.randrange(len(text))
        text = text[:at] + rng.choice((*PARTS, "[" * 100_000, '{"a":' * 50_000)) + text[at + rng.choice((0, 1, 90)) :]
    return text
