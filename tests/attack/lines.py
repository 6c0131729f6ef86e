"""Hostile command lines, grown from the parser itself: each command with its options and hostile arguments."""

import argparse
from functools import cache
from pathlib import Path
from random import Random

from hostile import NUMBERS, UNITS, WORDS, file, known_keys
from tables import good_table, table

from kinetostat.cli import _parser
from kinetostat.machine.loading import bundled

LONG = {"studio", "reproduce", "optimize", "pareto", "validate", "doctor", "workspace", "report"}
"""Commands that serve, or work for seconds when all is well: they are attacked in the tests of each of them."""
PARTS = ("joints", "zeros", "gains", "clearances", "compliances", "geometry", "shared", "legs.*", "*", "[", "frame")
SIZES = (
    "0.05 mm", "0.1 deg", "20 um/m", "10 %", "sigma 0.02 mm", "IT7", "IT99", "IT7 at 300 mm", "ISO 2768-m at 1e9 mm",
    "0", "-1 mm", "1e-320 mm", "inf mm", "nan", "rigid", "1 kg", "", '["0.05 mm", "0.02 deg"]', "sigma", "IT", "1 m",
)  # fmt: skip
"""What tolerances, priors and bounds are about, and how large they are."""
CSV_FILES = ("data", "poses")
"""Arguments that are CSV files, of the machine of `tables`."""
QUICK_MACHINES = ("zhang-gosselin-4dof", "hexapod", "planar-3rpr", "tricept", "delta", "tripteron")


@cache
def placed_files() -> tuple[str, ...]:
    """Files of poses and measurements, put into the current folder."""
    texts = {"good.csv": good_table(), **{f"spoilt-{n}.csv": table(Random(f"file {n}")) for n in range(9)}}
    for name, text in texts.items():
        Path(name).write_bytes(text.encode(errors="surrogatepass"))
    return (*texts, *(["good.csv"] * len(texts)))


@cache
def commands() -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands by name."""
    (action,) = [a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction)]
    return {name: parser for name, parser in action.choices.items() if name not in LONG}


def command_line(rng: Random) -> list[str]:
    """A command with some of its options, each with an argument that may be good, odd or absurd."""
    name = rng.choice([*commands()])
    line = [name]
    for action in commands()[name]._actions:
        if isinstance(action, argparse._HelpAction):
            continue
        if not action.option_strings:
            line += [_positional(rng, action)] if rng.random() < 0.95 else []
        elif action.required or rng.random() < 0.25:
            line.append(rng.choice(action.option_strings))
            if action.nargs != 0:
                line.append(_argument(rng, action))
    if rng.random() < 0.05:
        line.insert(rng.randrange(len(line) + 1), rng.choice(WORDS))
    return [part.replace("\x00", "") for part in line]


def _positional(rng: Random, action: argparse.Action) -> str:
    if action.choices and rng.random() < 0.9:
        return rng.choice([*map(str, action.choices)])
    if action.dest in CSV_FILES and rng.random() < 0.9:
        return rng.choice(placed_files())
    if rng.random() < 0.85:
        return rng.choice(QUICK_MACHINES)
    return rng.choice((*WORDS, "no-such.toml", ".", "/", "/dev/null", "/etc/passwd", *bundled()))


def _argument(rng: Random, action: argparse.Action) -> str:
    if action.choices and rng.random() < 0.8:
        return rng.choice([*map(str, action.choices)])
    what = f"{action.dest} {action.metavar}".lower()
    if "output" in what or "-o" in action.option_strings:
        return rng.choice(("out", "out.nc", "out.csv", "no/such/folder/out.csv", ".", "out.xml", "out.glb"))
    if "set" in what:
        return setting(rng)
    if "vary" in what or "over" in what:
        return f"{rng.choice(known_keys())}={_end(rng)}:{_end(rng)}:{rng.choice((1, 2, 3, 5, 0, -1, 'x', 1e9))}"
    if action.dest in ("tolerances", "priors", "bounds"):
        return f"{rng.choice(PARTS)}={rng.choice(SIZES)}"
    if action.dest == "fit":
        return rng.choice(PARTS)
    if "along" in what:
        return ",".join(str(rng.choice(NUMBERS)) for _ in range(rng.choice((3, 3, 3, 2, 4))))
    return str(rng.choice((*WORDS, *NUMBERS)))


def _end(rng: Random) -> str:
    return f"{rng.choice((*NUMBERS, 'a'))} {rng.choice(UNITS[:9])}"


def setting(rng: Random) -> str:
    """A `--set` of a known or unknown field to anything."""
    field = ".".join(rng.choice(known_keys()) for _ in range(rng.choice((1, 2, 2, 3))))
    if rng.random() < 0.4:
        field = rng.choice(("stiffness.actuator", "pose.z", "geometry.base_radius", "limits.longest_leg", "load.force"))
    index = f".{rng.choice((0, 1, 5, 99, -1))}" if rng.random() < 0.2 else ""
    given = rng.choice((*WORDS, *map(str, NUMBERS), "rigid", "0", "1 mm", '["0 N", "0 N", "-500 N"]'))
    return f"{field}{index}={given}" if rng.random() < 0.95 else file(rng, "study")[:300]
