"""Errors in what people give us. Each message is one readable paragraph that says how to mend it."""

import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

PRINTABLE = r"^[^\u0000-\u001f\u007f-\u009f\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]*$"
"""Names: no control characters, which would reach terminals, and none that reverse the text after them."""
LONGEST_WORD = 300
"""Characters without a space in a message: more than paths usually have, and less than would fill a terminal."""
_LONG = re.compile(rf"\S{{{LONGEST_WORD},}}")
Mistake = TypeVar("Mistake")
SHOWN_MISTAKES = 5
"""Mistakes of a file that a message shows: as many as people mend before they try again."""
WORDED_MISTAKES = 100
"""Mistakes that are put into words at all, so that equal sentences are found: a hostile file has thousands."""


class InputError(ValueError):
    """Bad input: the message names the field, the value, what is allowed and the fix. Commands exit with 2.

    What people wrote is quoted in messages; characters in it that cannot be printed are shown by their escapes, and a
    word of hundreds of characters is cut, wherever it comes from: names and keys may be as long as a file.
    """

    def __init__(self, message: str) -> None:
        printable = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in message)
        super().__init__(_LONG.sub(lambda word: cut(word[0], LONGEST_WORD), printable))


def shorten(value: object) -> str:
    """Return a value as people wrote it, cut to a bounded length."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except ValueError:  # Python refuses to write integers of thousands of digits
        return "a number of thousands of digits"
    except Exception:  # an object of somebody else's class, which may not be able to show itself
        return f"an object of the class {type(value).__name__}"
    return cut(text)


def cut(text: str, longest: int = 60) -> str:
    """Return a text, with an ellipsis in the place of what exceeds a length."""
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def several(given: str | Iterable[str]) -> list[str]:
    """Return texts as a list; one text alone stands for a list of it."""
    return [given] if isinstance(given, str) else list(given)


def choice(value: object, known: Iterable[str], what: str) -> str:
    """Return the value, if it is one of the known names.

    Raises:
        InputError: "what is ..." with the name that was probably meant, or all of them.
    """
    names = list(known)
    if isinstance(value, str) and value in names:
        return value
    near = difflib.get_close_matches(value, names, 1) if isinstance(value, str) else []
    hint = f'did you mean "{near[0]}"?' if near else f"choose from {_list_of(names) or 'none: nothing is defined'}."
    raise InputError(f"{what} is {'missing' if value is None else shorten(value)}; {hint}")


def _list_of(names: Sequence[str]) -> str:
    """Return all names with commas; those that count on by the first and the last: frequency_1 to frequency_6."""
    runs: list[list[str]] = []
    for name in names:
        if runs and _next(runs[-1][-1]) == name:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)


def _next(name: str) -> str | None:
    """Return the name that counts on: leg_2 after leg_1; None after a name without a number."""
    stem = name.rstrip("0123456789")
    return f"{stem}{int(name[len(stem) :]) + 1}" if stem != name else None


def first_mistakes(mistakes: Sequence[Mistake], sentence: Callable[[Mistake], str]) -> str:
    """Return a sentence for each of the first different mistakes of a file, and how many more there are."""
    sentences = list(dict.fromkeys(sentence(mistake) for mistake in mistakes[:WORDED_MISTAKES]))
    hidden = len(sentences[SHOWN_MISTAKES:]) + len(mistakes[WORDED_MISTAKES:])
    return " ".join(sentences[:SHOWN_MISTAKES]) + (f" (and {hidden} more)" if hidden else "")
