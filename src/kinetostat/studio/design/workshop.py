"""What outlives a page of the design tab: searches and favourites of one state folder, shared by all pages."""

from pathlib import Path

from kinetostat.studio.design.favourites import Favourites
from kinetostat.studio.design.runs import Runs


class Workshop:
    """Searches and favourites; one object of a server.

    Attributes:
        runs: searches.
        favourites: machines that are kept.
    """

    def __init__(self, state: Path) -> None:
        """Those of a state folder."""
        self.runs, self.favourites = Runs(state), Favourites(state)

    def close(self) -> None:
        """Let all searches end after their step."""
        self.runs.close()
