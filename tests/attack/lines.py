"""Hostile command lines, grown from the parser itself: each command with its options and hostile arguments."""

import argparse
from functools import cache
from pathlib import Path
from random import Random

from hostile import NUMBERS, UNITS, WORDS, file, known_keys
from tables import GOOD_ENTRIES, good_machine, good_record, good_table, table

from kinetostat.cli import _parser
from kinetostat.machine.loading import bundled

LONG = {"studio", "reproduce", "optimize", "pareto", "doctor", "report"}
"""Commands that serve, or work for seconds when all is well: they are attacked in the tests of each of them."""
ALWAYS = {
    "validate": ("--measured", "good-entries.csv"),
    "workspace": ("--over=x=-1 mm:1 mm:2", "--over=y=-1 mm:1 mm:2"),
}
"""What such commands are always given, so that they take less than that."""
PARTS = ("joints", "zeros", "gains", "clearances", "compliances", "geometry", "shared", "legs.*", "*", "[", "frame")
SIZES = (
    "0.05 mm", "0.1 deg", "20 um/m", "10 %", "sigma 0.02 mm", "IT7", "IT99", "IT7 at 300 mm", "ISO 2768-m at 1e9 mm",
    "0", "-1 mm", "1e-320 mm", "inf mm", "nan", "rigid", "1 kg", "", '["0.05 mm", "0.02 deg"]', "sigma", "IT", "1 m",
)  # fmt: skip
"""What tolerances, priors and bounds are about, and how large they are."""
CSV_FILES = ("data", "poses", "measured")
"""Arguments that are CSV files, of the machine of `tables`."""
QUICK_MACHINES = ("zhang-gosselin-4dof", "hexapod", "planar-3rpr", "tricept", "delta", "tripteron", "loaded.toml")
"""The last one is that of `tables`, with masses, tolerances and loads."""
OFFERED = {
    "inputs": ("fx", "fx,fy", "leg 1", "fx,fx", "", ",", "fz,leg 1,mz", "x", "f" * 5000),
    "outputs": ("x", "x,y,rz", "leg 1", "x,x", "", ",", "fx", "\u202ex", "rx"),
    "quantities": (
        "frequency", "frequency_1", "frequency_7", "loaded_frequency_1", "least_real_receptance", "stable_width",
        "mass", "displacement", "displacement_x", "tangent_stiffness", "tangent_free_stiffness_z", "load_factor",
        "slack_springs", "stiffness", "compliance_x", "singularity_margin",
    ),
    "tolerance": ("0.1 um", "1 mm", "0", "-1 um", "1e-30 m", "5 kg"),
    "allocate": ("0.05 mm", "1 um", "0", "-1 mm", "1e-30 m", "1e9 m", "5 kg", "rigid"),
    "lowest": ("10 Hz", "1e-9 Hz", "1e19 Hz", "10 rad/s", "0 Hz", "-5 Hz", "7"),
    "highest": ("500 Hz", "1 mHz", "1e19 Hz", "3 kHz", "1e999 Hz", "20"),
    "cutting_pressure": ("2000 N/mm**2", "1e-300 Pa", "1e20 Pa", "0", "-1 Pa", "2 GPa"),
    "sigma": ("5 um", "3 %", "0 mm", "1e-300 m", "10 deg", "-1 um"),
    "sigma_angle": ("20 urad", "0 deg", "5 um", "1e300 rad"),
    "units": ("si", "mm", "um, mrad", "N/um, N/um", "furlong", "Hz", "kg"),
    "formats": ("svg", "png,svg", "pdf", "gif", ",", "png,png"),
    "conditions": ("frequency_1 > 1 Hz", "stiffness_x > 1 N/um", "mass < 3", "x ! y", "loaded_frequency_1 > 3 rad/s"),
}  # fmt: skip
"""What options may be given, good and odd, by the name of the argument."""
HOSTILE_SHARE = 0.3
"""How often an option is given anything all the same."""


@cache
def files() -> dict[str, str]:
    """Files of poses, of measurements, of a fit and of a machine by name."""
    spoilt = {f"spoilt-{n}.csv": table(Random(f"file {n}")) for n in range(9)}
    tables = {"good.csv": good_table(), "good-entries.csv": GOOD_ENTRIES, **spoilt}
    return {**tables, "fit.json": good_record(), "loaded.toml": good_machine()}


def placed_tables() -> list[str]:
    """Names of CSV files, every second one good, of which `place_files` makes files in the current folder."""
    names = [name for name in files() if name.endswith(".csv")]
    return names + ["good.csv", "good-entries.csv"] * (len(names) // 2)


def place_files() -> None:
    """Put all files into the current folder: every case has a folder of its own."""
    for name, text in files().items():
        Path(name).write_bytes(text.encode(errors="surrogatepass"))


@cache
def commands() -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands by name."""
    (action,) = [a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction)]
    for parser in action.choices.values():
        parser.fill()
    return {name: parser for name, parser in action.choices.items() if name not in LONG}


def command_line(rng: Random) -> list[str]:
    """A command with some of its options, each with an argument that may be good, odd or absurd."""
    place_files()
    name = rng.choice([*commands()])
    line = [name, *(ALWAYS.get(name, ()) if rng.random() < 0.9 else ())]
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
        return rng.choice(placed_tables())
    if rng.random() < 0.85:
        return rng.choice(QUICK_MACHINES)
    return rng.choice((*WORDS, "no-such.toml", ".", "/", "/dev/null", "/etc/passwd", *bundled()))


def _argument(rng: Random, action: argparse.Action) -> str:
    if action.choices and rng.random() < 0.8:
        return rng.choice([*map(str, action.choices)])
    if action.dest in OFFERED and rng.random() > HOSTILE_SHARE:
        return rng.choice(OFFERED[action.dest])
    if action.dest in ("fit", "measured") and action.metavar != "WHAT" and rng.random() > HOSTILE_SHARE:
        return rng.choice(("fit.json", ".", *placed_tables()) if action.dest == "fit" else placed_tables())
    drawn = _of_options_alike(rng, action)
    return str(rng.choice((*WORDS, *NUMBERS))) if drawn is None else drawn


def _of_options_alike(rng: Random, action: argparse.Action) -> str | None:
    """An argument of one of the sorts that several options have; None of other options."""
    what = f"{action.dest} {action.metavar}".lower()
    if "output" in what:
        return rng.choice(("out", "out.nc", "out.csv", "no/such/folder/out.csv", ".", "out.xml", "out.glb", "out.html"))
    if "set" in what:
        return setting(rng)
    if "vary" in what or "over" in what:
        if rng.random() < 0.5:
            return f"{rng.choice(AXES)}:{rng.choice((2, 2, 3, 1, 10**7))}"
        return f"{rng.choice(known_keys())}={_end(rng)}:{_end(rng)}:{rng.choice((1, 2, 3, 5, 0, -1, 'x', 1e9))}"
    if action.metavar == "WHAT=VALUE" or action.dest in ("priors", "bounds"):
        return f"{rng.choice(PARTS)}={rng.choice(SIZES)}"
    if action.dest == "fit":
        return rng.choice(PARTS)
    if action.dest in ("samples", "exact", "next", "seed"):
        return rng.choice(("1", "2", "3", "0", "-1", "16", "999999999999", "1.5", "x"))
    if "along" in what:
        return ",".join(str(rng.choice(NUMBERS)) for _ in range(rng.choice((3, 3, 3, 2, 4))))
    return None


AXES = ("x=-1 mm:1 mm", "gravity_angle=0 deg:90 deg", "load.force.2=-5 N:5 N", "angle=-1 deg:1 deg", "z=13 cm:14 cm")


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
