"""Errors in what people give us. Each message is one readable paragraph that says how to mend it."""

import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

Mistake = TypeVar("Mistake")

PRINTABLE = r"^[^\u0000-\u001f\u007f-\u009f\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]*$"
"""Names: no control characters, which would reach terminals, and none that reverse the text after them."""
LONGEST_QUOTE = 60
"""Characters of a value that a message quotes: enough to find it in a file, and most of a line of a terminal."""
LONGEST_WORD = 300
"""Characters without a space in a message: more than paths usually have, and less than would fill a terminal."""
SHOWN_MISTAKES = 5
"""Mistakes of a file that a message shows: as many as people mend before they try again."""
WORDED_MISTAKES = 100
"""Mistakes that are put into words at all, so that equal sentences are found: a hostile file has thousands."""

_LONG_WORD = re.compile(rf"\S{{{LONGEST_WORD},}}")
_NUMBERED = re.compile(r"(.*?)([0-9]{1,9})", re.DOTALL)
"""A name that ends in a number, of which Python can convert so many digits at once: it refuses thousands."""


class InputError(ValueError):
    """Bad input: the message names the field, the value, what is allowed and the fix. Commands exit with 2.

    What people wrote is quoted in messages; characters in it that cannot be printed are shown by their escapes, and a
    word of hundreds of characters is cut, wherever it comes from: names and keys may be as long as a file.
    """

    def __init__(self, message: str) -> None:
        printable = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in message)
        super().__init__(_LONG_WORD.sub(lambda word: cut(word[0], LONGEST_WORD), printable))


def shorten(value: object) -> str:
    """Return a value as people wrote it, cut to `LONGEST_QUOTE`."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except ValueError:  # Python refuses to write integers of thousands of digits
        return "a number of thousands of digits"
    except Exception:  # an object of somebody else's class, which may not be able to show itself
        return f"an object of the class {type(value).__name__}"
    return cut(text)


def cut(text: str, longest: int = LONGEST_QUOTE) -> str:
    """Return a text, with an ellipsis in the place of what exceeds a length."""
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def nearest(value: str, known: Iterable[str]) -> str:
    """Return the known name that a value was probably meant to be; empty if it resembles none of them."""
    return next(iter(difflib.get_close_matches(value, list(known), 1)), "")


def hint(value: str, known: Iterable[str], otherwise: str, quoted: bool = True) -> str:
    """Return the end of a message on an unknown name: 'did you mean "leg 1"?', or other advice if no name is near.

    Args:
        value: the name as it was written.
        known: the names that there are.
        otherwise: a clause that says what there is, with its full stop.
        quoted: whether names stand in quotes; names of fields do not.
    """
    name = nearest(value, known)
    if not name:
        return otherwise
    return f'did you mean "{name}"?' if quoted else f"did you mean {name}?"


def choice(value: object, known: Iterable[str], what: str) -> str:
    """Return the value, if it is one of the known names.

    Raises:
        InputError: "what is ..." with the name that was probably meant, or all of them.
    """
    names = list(known)
    if isinstance(value, str) and value in names:
        return value
    advice = f"choose from {_list_of(names) or 'none: nothing is defined'}."
    advice = hint(value, names, advice) if isinstance(value, str) else advice
    raise InputError(f"{what} is {'missing' if value is None else shorten(value)}; {advice}")


def _list_of(names: Sequence[str]) -> str:
    """Return all names with commas, and a run of numbered names by its ends: frequency_1 to frequency_6."""
    runs: list[list[str]] = []
    for name in names:
        if runs and _successor(runs[-1][-1]) == name:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)


def _successor(name: str) -> str | None:
    """Return the name with the next number: leg_2 after leg_1; None after a name without a number."""
    numbered = _NUMBERED.fullmatch(name)
    return f"{numbered[1]}{int(numbered[2]) + 1}" if numbered else None


def first_mistakes(mistakes: Sequence[Mistake], sentence: Callable[[Mistake], str]) -> str:
    """Return a sentence for each of the first different mistakes of a file, and how many more there are."""
    sentences = list(dict.fromkeys(sentence(mistake) for mistake in mistakes[:WORDED_MISTAKES]))
    hidden = len(sentences[SHOWN_MISTAKES:]) + len(mistakes[WORDED_MISTAKES:])
    return " ".join(sentences[:SHOWN_MISTAKES]) + (f" (and {hidden} more)" if hidden else "")
