"""Questions about a machine, and answers that describe themselves: the nouns from which every surface is made.

A question says its word, what it takes and which function answers. The description of the answer lists fields,
sentences, tables and figures once. Surfaces are made of both elsewhere: `data_forms`, `terminal`, `notebook`,
`report.described`, `commands.asking`, the studio.
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
"""How a number is taken from an answer: the name of an attribute, with dots, or a function."""
Late = str | Callable[..., Any]
"""A function, or where it lives, "views.vibration_figures.vibration_figures": it is imported when it is first used."""


def late(function: Late) -> Any:
    """Import the function, or what else a text names; a function is returned as it is."""
    if not isinstance(function, str):
        return function
    module, _, name = function.rpartition(".")
    return getattr(import_module(f"kinetostat.{module}"), name)


@dataclass(frozen=True)
class Field:
    """A value of an answer, or of each of its records.

    Attributes:
        key: its name in JSON, CSV and NetCDF.
        take: how it is taken; the attribute of the name `key` if empty. A mapping has a value for each entry of an
            axis, such as x, y, z.
        unit: of its numbers in files, SI; empty where there is none.
        long_name: what it is, in words.
        axes: names of the axes of its array; of a mapping, the name of its one axis.
        forms: files that have it, some of "json", "csv" and "nc".
        optional: whether JSON leaves it out where it is None.
        column: its name in CSV and NetCDF if that is not the key. In CSV a mapping has a column for each entry, of the
            name "column_entry", or "entry" alone where `column` is "*".
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
        """Its name in tables of numbers."""
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
"""The sentence on loads of the file that do not count: an answer with this field says it on all surfaces."""


@dataclass(frozen=True)
class Records:
    """Several things of one kind in an answer, such as its modes: objects in JSON, rows in CSV, an axis in NetCDF.

    Attributes:
        key: of their list in JSON.
        axis: name of one of them: the axis in NetCDF, and the head of the column that counts them in CSV.
        fields: what each of them has.
        take: how they are taken from the answer; the attribute of the name `key` if empty.
        forms: files that have them.
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
    """A figure of an answer that is drawn when it is called; `title=""` draws it without a title, below a caption.

    Attributes:
        caption: a sentence for a report.
        draw: draws it.
        minor: whether a report leaves it out.
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
"""Sentences, each with the word that stands before it, such as "Damping"."""
NO_PARTS: Callable[[Any], tuple[()]] = lambda _answer: ()  # noqa: E731 - a default that several fields share


@dataclass(frozen=True)
class Description:
    """All that surfaces know of answers of one kind.

    Attributes:
        title: of a section or a panel that shows one.
        fields: values and records of the answer, in the order of JSON.
        lines: the sentences, the answer first. The line "Pose" is left out where a report has said it.
        tables: the tables, each with a title, and sentences between them; `full` wants every row.
        figures: drawings by name, the most telling first.
        makers: functions that make a form of their own, such as the dataset that an answer already holds.
        axes: of the arrays in NetCDF.
        machine: how the machine is taken from the answer.
        state: what stands behind its name in the first line.
        answered: whether there is an answer; where there is none, `message` of the answer says why.
        files: name of each file that a folder of results gets, with its form "json", "csv" or "nc", or a function
            that writes its text, dataset or plain data; where this gives None, there is no such file.
        kept: whether the answer keeps what its file demands; a command says by its exit code where it does not.
        undrawn: why a folder of results gets nothing, where that is so.
        figure_prefix: stands before the names of the figures in a folder.
    """

    title: str
    fields: tuple[Field | Records, ...]
    lines: Callable[[Any], Lines] = NO_PARTS
    tables: "Callable[..., Iterable[Table | str]]" = NO_PARTS
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
        """Files that an answer can be: JSON, CSV where it has records, NetCDF where it has arrays; and what is made."""
        tables = [part for part in self.fields if isinstance(part, Records)]
        arrays = [part for part in self.fields if isinstance(part, Field) and part.axes and "nc" in part.forms]
        csv = ("csv",) if any("csv" in part.forms for part in tables) else ()
        nc = ("nc",) if arrays or any("nc" in part.forms for part in tables) else ()
        return tuple(dict.fromkeys(["json", *csv, *nc, *self.makers]))

    def sentences(self, answer: Any) -> Lines:
        """The lines of an answer, with one about the loads of the file that do not count behind the first."""
        first, *others = [*self.lines(answer)] or [("", "")]
        parts = [part for part in self.fields if isinstance(part, Field) and part.key == LOADS_LEFT_OUT.key]
        uncounted = parts[0].of(answer) if parts else ""
        lines = [first, ("Loads", uncounted), *others]
        return [(head, sentence) for head, sentence in lines if sentence]

    def machine_of(self, answer: Any) -> "Machine":
        """The machine that an answer is about."""
        machine: Machine = Field("machine", self.machine).of(answer)
        return machine

    def drawings(self, answer: Any) -> "dict[str, Drawing]":
        """The figures of an answer by name; none where nothing can be drawn."""
        return dict(late(self.figures)(answer)) if self.figures else {}


Kind = Literal["flag", "direction", "count", "number", "choice", "quantity", "text", "file", "setting"]
"""Kinds of what an option takes: `quantity` is a text with a unit, `file` a path, `setting` a line in the table of the
machine file that is named as the option is: it changes the machine and is not handed on."""


@dataclass(frozen=True)
class Option:
    """Something that a question takes besides the machine; on the command line, in Python and in the studio.

    Attributes:
        name: the argument in Python; on the command line `--name`, with dashes.
        kind: kind of what is given.
        meaning: a phrase for the help.
        metavar: the word that stands for it in the help, such as "X,Y,Z".
        default: what counts where nothing is given.
        choices: what may be chosen, for the kind "choice".
        many: whether it may be given several times; its value is then a list.
        first: whether the command line takes it without its name, after the machine.
        required: whether it must be given.
        word: the option on the command line if it is not the name.
        former: earlier words of the command line, which still work and warn.
    """

    name: str
    kind: Kind
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
        example: a command line.
        answer: the function: takes a machine and the options by name, and `progress` if it takes long.
        options: what it takes besides the machine.
        loaded: help on `--loaded`, where the state of the machine matters.
        output: words on what a folder of results gets, or on the files; empty if nothing is written.
        suffixes: of the files that `--output` names, where an answer is written to files instead of a folder.
        slow: words on what is being done, where the function takes `progress` or people would wonder.
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
