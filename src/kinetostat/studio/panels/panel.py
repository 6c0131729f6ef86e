"""What the linked views have in common: a name, a place on the page, and what they need to know."""

from typing import Protocol

from kinetostat.studio.answers import Report
from kinetostat.studio.session import Session


class Panel(Protocol):
    """A linked view. It is built once, and told of every new analysis while it is in front."""

    name: str

    def build(self) -> None:
        """Put its elements on the page, empty."""

    def show(self, report: Report, session: Session) -> None:
        """Show a new analysis of a pose that has an answer."""

    def close(self) -> None:
        """The page is gone: ask for nothing any more."""
