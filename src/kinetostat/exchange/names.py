"""What people call a machine, as other programs can hold it. Knows no format."""


def printable(text: str) -> str:
    """Text in one line, without what XML cannot hold: other characters become question marks."""
    return "".join(c if c.isprintable() else "?" for c in text)


def plain(text: str) -> str:
    """The same in ASCII, as programs for finite elements read it."""
    return printable(text).encode("ascii", "replace").decode("ascii")
