"""Questions about a machine, and answers that describe themselves: the nouns from which every surface is made.

A question names the function that answers it and its options. The description of the answer lists fields, sentences,
tables and figures once. Other files make the surfaces of both: `data_forms`, `tables`, `notebook`, `report.answers`,
`commands.asking`, `studio.question_tab`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal

from kinetostat.frozen import dataclass

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.table import Table

    from kinetostat.machine.machine import Machine

Take = str | Callable[[Any], Any]
"""The way to a number of an answer: the name of an attribute, with dots, or a function of the answer."""
Late = str | Callable[..., Any]
"""A function, or its place, "views.vibration_figures.vibration_figures", from which it is imported at its first use."""


def late(function: Late) -> Any:
    """Import the object that a text names; a function is returned as it is."""
    if not isinstance(function, str):
        return function
    module, _, name = function.rpartition(".")
    return getattr(import_module(f"kinetostat.{module}"), name)


@dataclass(frozen=True)
class Field:
    """A value of an answer, or of each of its records.

    Attributes:
        key: name of the value in JSON, CSV and NetCDF.
        take: the way to the value; the attribute with the name `key` if empty. A mapping has a value for each entry of
            an axis, such as x, y, z.
        unit: unit of its numbers in files, SI; empty if it has none.
        long_name: its meaning in a phrase.
        axes: the names of the axes of its array, or of the one axis of a mapping.
        forms: kinds of files that have it, of "json", "csv" and "nc".
        optional: whether JSON leaves it out if it is None.
        column: its name in CSV and NetCDF if that is not the key. In CSV a mapping has a column for each entry with the
            name "column_entry", or "entry" alone if `column` is "*".
    """

    key: str
    take: Take = ""
    unit: str = ""
    long_name: str = ""
    axes: tuple[str, ...] = ()
    forms: tuple[str, ...] = ("json", "csv", "nc")
    optional: bool = False
    column: str = ""

    @property
    def name(self) -> str:
        """The name of the value in CSV and NetCDF."""
        return self.key if self.column in ("", "*") else self.column

    def of(self, item: Any) -> Any:
        """Take the value from an answer or a record, which may be a mapping."""
        take = self.take or self.key
        if not isinstance(take, str):
            return take(item)
        return item[take] if isinstance(item, Mapping) else attrgetter(take)(item)


NAME = Field("name", "machine.name")
STATUS = Field("status", "status.word")
MESSAGE = Field("message")
FIRST_FIELDS = (NAME, STATUS, MESSAGE)
"""Fields with which answers about a machine begin: its name, and the status of its pose in a word and in a sentence."""
LOADS_LEFT_OUT = Field("loads_left_out", forms=("json",))
"""The sentence on loads of the file that do not count: an answer with this field shows it on all surfaces."""
REQUIREMENTS = Field("requirements", lambda answer: answer.requirements or None, optional=True)
"""Verdicts on the requirements of the file; a file without them has no such key."""


def requirements_met(answer: Any) -> bool:
    """Return whether an answer keeps all requirements of its file, as a `Description` asks."""
    return all(verdict.met for verdict in answer.requirements)


@dataclass(frozen=True)
class Records:
    """Several things of one kind in an answer, such as its modes: objects in JSON, rows in CSV, an axis in NetCDF.

    Attributes:
        key: name of their list in JSON.
        axis: name of one of them: of the axis in NetCDF, and of the column that counts them in CSV.
        fields: the values of each of them.
        take: the way to them in the answer; the attribute with the name `key` if empty.
        forms: kinds of files that have them.
    """

    key: str
    axis: str
    fields: tuple[Field, ...]
    take: Take = ""
    forms: tuple[str, ...] = ("json", "csv", "nc")

    def of(self, answer: Any) -> list[Any]:
        """Take the records from an answer."""
        return list(Field(self.key, self.take).of(answer))


@dataclass(frozen=True)
class Axis:
    """An axis of arrays in NetCDF: its coordinates, their unit and their meaning."""

    name: str
    take: Take
    unit: str = ""
    long_name: str = ""


@dataclass(frozen=True)
class Drawing:
    """A figure of an answer, which a call draws.

    Attributes:
        caption: a sentence for a report.
        draw: function that draws the figure. Its argument `title` stands over the figure, with braces for the name of
            the machine; a figure with a caption has none ("").
        minor: whether a report leaves the figure out.
        file: name of its file without the suffix, if that is not the name of the figure.
    """

    caption: str
    draw: "Callable[..., Figure]"
    minor: bool = False
    file: str = ""

    def __call__(self, **options: Any) -> "Figure":
        """Draw the figure."""
        return self.draw(**options)


Lines = Iterable[tuple[str, str]]
"""Sentences, each with the word before it, such as "Damping"."""


def no_parts(*_arguments: Any) -> tuple[()]:
    """Return no sentences or no tables: those of an answer that has none."""
    return ()


@dataclass(frozen=True)
class Description:
    """Everything that surfaces know of answers of one kind.

    Attributes:
        title: title of a section or a panel that shows an answer.
        fields: values and records of the answer, in the order of JSON.
        lines: the sentences, the answer first. A report leaves the line "Pose" out, because its first page has it.
        tables: the tables, each with a title, and sentences between them; with `full`, every row.
        figures: drawings by name, the most important first.
        makers: functions that make a form in a way of their own, such as the dataset that an answer already holds.
        axes: axes of the arrays in NetCDF.
        machine: the way to the machine in the answer.
        state: text after the name of the machine in the first line.
        answered: whether there is an answer; if not, `message` of the answer says why.
        files: name of each file in a folder of results, with its form "json", "csv" or "nc", or with a function that
            returns its text, dataset or plain data, or None if the answer has no such file.
        kept: whether the answer keeps the requirements of its file; if not, a command says so by its exit code.
        undrawn: the reason why a folder of results would be empty; empty if it would not.
        figure_prefix: beginning of the names of the figures in a folder.
    """

    title: str
    fields: tuple[Field | Records, ...]
    lines: Callable[[Any], Lines] = no_parts
    tables: "Callable[..., Iterable[Table | str]]" = no_parts
    figures: Late | None = None
    makers: Mapping[str, Late] = field(default_factory=dict)
    axes: tuple[Axis, ...] = ()
    machine: Take = "machine"
    state: Callable[[Any], str] = lambda answer: answer.status.word
    answered: Callable[[Any], bool] = lambda _answer: True
    files: Mapping[str, Late] = field(default_factory=dict)
    kept: Callable[[Any], bool] = lambda _answer: True
    undrawn: str = ""
    figure_prefix: str = ""

    @property
    def forms(self) -> tuple[str, ...]:
        """Kinds of files that an answer can be: JSON, CSV if it has records, NetCDF if it has arrays, and `makers`."""
        tables = [part for part in self.fields if isinstance(part, Records)]
        arrays = [part for part in self.fields if isinstance(part, Field) and part.axes and "nc" in part.forms]
        csv = ("csv",) if any("csv" in part.forms for part in tables) else ()
        nc = ("nc",) if arrays or any("nc" in part.forms for part in tables) else ()
        return tuple(dict.fromkeys(["json", *csv, *nc, *self.makers]))

    def sentences(self, answer: Any) -> Lines:
        """Return the lines of an answer; after the first one, a line about the loads of the file that do not count."""
        first, *others = [*self.lines(answer)] or [("", "")]
        parts = [part for part in self.fields if isinstance(part, Field) and part.key == LOADS_LEFT_OUT.key]
        left_out = parts[0].of(answer) if parts else ""
        lines = [first, ("Loads", left_out), *others]
        return [(head, sentence) for head, sentence in lines if sentence]

    def machine_of(self, answer: Any) -> "Machine":
        """Return the machine of an answer."""
        machine: Machine = Field("machine", self.machine).of(answer)
        return machine

    def drawings(self, answer: Any) -> "dict[str, Drawing]":
        """Return the figures of an answer by name; none if nothing can be drawn."""
        return dict(late(self.figures)(answer)) if self.figures else {}


OptionKind = Literal["flag", "direction", "count", "number", "choice", "quantity", "text", "file", "setting"]
"""Kinds of the value of an option: `quantity` is a text with a unit, and `file` a path. `setting` is a line in the
table of the machine file that has the option's name: it changes the machine and is not handed to the function."""


@dataclass(frozen=True)
class Option:
    """An option of a question besides the machine: on the command line, in Python and in the studio.

    Attributes:
        name: name of the argument in Python; `--name`, with dashes, on the command line.
        kind: kind of its value.
        meaning: a phrase for the help.
        metavar: the word for its value in the help, such as "X,Y,Z".
        default: the value if none is given.
        choices: the values of the kind "choice".
        many: whether it may be given several times; its value is then a list.
        first: whether the command line takes it without its name, after the machine.
        required: whether it must be given.
        word: the option on the command line if that is not `--name`.
        former: earlier words of the command line, which still work and warn.
    """

    name: str
    kind: OptionKind
    meaning: str
    metavar: str = ""
    default: Any = None
    choices: tuple[str, ...] = ()
    many: bool = False
    first: bool = False
    required: bool = False
    word: str = ""
    former: tuple[str, ...] = ()

    @property
    def flag(self) -> str:
        """The option as it is typed, such as "--cutting-pressure"."""
        return self.word or "--" + self.name.replace("_", "-")


@dataclass(frozen=True)
class Question:
    """A question about a machine; its word and a phrase about it are in `questions`.

    Attributes:
        example: a command line for the help.
        answer: the function that answers: it takes a machine, the options by name, and `progress` if it takes long.
        options: the options of the question.
        loaded: help on `--loaded`; empty if the state of the machine does not matter.
        output: a phrase on the contents of a folder of results, or on the files; empty if nothing is written.
        suffixes: suffixes of the files that `--output` names, for an answer that is written to files without a folder.
        slow: word beside the progress bar for the work being done, such as "searching".
        reports_progress: whether the function takes `progress`.
        full: help on `--full`; empty if there is nothing more to show.
    """

    example: str
    answer: Callable[..., Any]
    options: tuple[Option, ...] = ()
    loaded: str = ""
    output: str = ""
    suffixes: tuple[str, ...] = ()
    slow: str = "computing"
    reports_progress: bool = False
    full: str = ""

    def arguments(self, values: Mapping[str, Any]) -> tuple[list[str], dict[str, Any]]:
        """Part the options that were given into overrides of the machine's file and arguments of `answer`.

        Args:
            values: values of all options by name; those without a value are left to the defaults of `answer`.
        """
        tables = [option.name for option in self.options if option.kind == "setting"]
        overrides = [f"{table}.{text}" for table in tables for text in values[table]]
        arguments = {name: value for name, value in values.items() if name not in tables and value not in (None, [])}
        return overrides, arguments


QUANTITIES_HELP = (
    "compliance, stiffness or free_stiffness (all entries of the diagonal; the free stiffness is 1/C_ii, which a tool "
    "feels; default: {default}); a single entry such as compliance_rx, stiffness_x_z, free_stiffness_z; "
    "least_translational_stiffness, greatest_translational_stiffness, least_rotational_stiffness, "
    "greatest_rotational_stiffness, frobenius_condition (of K), singularity_margin (0: singular, 1: best), "
    "aspect (1 or -1; the sign changes at singularities), shortest_leg, longest_leg, actuator_force, "
    "actuator_moment (the greatest under [load]), mass (of all moving parts), frequency (the six lowest natural "
    "frequencies) or frequency_1, least_wrench_force, least_wrench_moment, least_twist_speed, least_twist_rate, "
    "least_acceleration, least_angular_acceleration, greatest_wrench, greatest_twist, greatest_acceleration (loads, "
    "speeds and accelerations that the drives allow in all directions, and along each component), "
    "reversal_error, least_real_receptance and stable_width (across [cutting]); tension, least_tension, "
    "greatest_tension, tension_reserve, capacity and wrench_closure (of cables); of the machine at rest under its "
    "loads: "
    'displacement (the default where [load] says state = "loaded"), tangent_stiffness, tangent_free_stiffness, '
    "load_factor, slack_springs, snapped (1 where the machine has snapped over), loaded_frequency; repeatable"
)
"""Help on the quantities of sweeps, maps and sensitivities."""
DISPLACED = "the machine at rest under its loads: its displacement, if no quantity is named"
"""Help on `--loaded` of questions about quantities."""
LAW_TOLERANCE = Option(
    "tolerance",
    "quantity",
    'error at the tool that the law of the corrections may have, e.g. "0.1 um" (default: a thousandth of the error '
    "without corrections)",
    metavar="LENGTH",
)
VARIED = "FIELD=from:to:count[:log]"
"""Form of a field with its range, for the help."""


def quantities_option(default: str) -> Option:
    """Return the option `--quantity`, with the quantity that counts where none is named."""
    meaning = QUANTITIES_HELP.format(default=default)
    return Option("quantities", "text", meaning, metavar="NAME", many=True, word="--quantity")


def ranges_option(
    meaning: str, required: bool = False, metavar: str = "FIELD=from:to:count", word: str = "--over"
) -> Option:
    """Return the option `--over`: fields and their ranges."""
    return Option("ranges", "text", meaning, metavar=metavar, many=True, required=required, word=word)
