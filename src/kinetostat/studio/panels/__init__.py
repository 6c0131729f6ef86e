"""The linked views beside the machine: a class each, listed in `PANELS` of the page.

A panel shows results of `answers`; it holds no formula and knows nothing of the page around it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable

from kinetostat.kinematics.status import Status
from kinetostat.studio.answers import Report
from kinetostat.studio.elements import MachineView
from kinetostat.studio.session import Session


class Panel(ABC):
    """A linked view of the analysis, in a tab of its own.

    The page makes one of each class, calls `build` once inside the tab, `show` after every new analysis while the
    tab is in front, `leave` when it is no longer in front, and `close` when the browser has left.

    Attributes:
        name: text of the tab.
        show_change: the page's redrawing, called after the panel has given the session's machine other numbers.
        view: the picture of the machine, for panels that draw in it.
        is_busy: whether the page is still drawing the last change, for panels that play something.
    """

    name = ""
    show_change: Callable[[], None]
    view: MachineView
    is_busy: Callable[[], bool]

    @abstractmethod
    def build(self) -> None:
        """Create the elements of the panel, still empty, where the page is being built."""

    @abstractmethod
    def show(self, report: Report, session: Session) -> None:
        """Show a new analysis of a pose that has an answer.

        Args:
            report: the analysis and what is drawn of it.
            session: the machine with its controls, for panels that compute more.
        """

    def shows(self, report: Report) -> bool:
        """Return whether the panel has something to say about a report; of a machine that only loads hold, few have."""
        return report.analysis.status is Status.OK

    def leave(self) -> None:  # noqa: B027 - most panels show nothing outside their tab
        """Remove what the panel shows in the picture, because another tab is in front or the pose has no answer."""

    def close(self) -> None:  # noqa: B027 - most panels compute nothing, and need no `close`
        """Stop what is being computed; a panel that only shows the report has nothing to stop."""
