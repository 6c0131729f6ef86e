"""What can be wrong with what people give us. Each message is one readable paragraph that says how to mend it."""


class InputError(ValueError):
    """Bad input: the message names the field, the value, what is allowed and the fix. Commands exit with 2."""


def shorten(value: object, longest: int = 60) -> str:
    """A value as people wrote it, cut to a bounded length."""
    text = f'"{value}"' if isinstance(value, str) else repr(value)
    return text if len(text) <= longest else f"{text[: longest - 1]}…"
