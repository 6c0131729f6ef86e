"""The status of a pose: a number in arrays and files, a word in tables, a sentence for people."""

from enum import IntEnum

from kinetostat.spec.errors import InputError, shorten


class Status(IntEnum):
    """Whether a pose has results. Only `OK` has; the others say why there are none.

    A pose with several obstacles has the status of the most fundamental one: without a place there are no screws, at a
    singular or undecided pose no K and C, and only a pose that has both can be beyond a limit. So `JOINT_LIMIT` never
    hides a singular pose, and says that limits alone forbid the pose.
    """

    OK = 0
    OUT_OF_REACH = 1
    JOINT_LIMIT = 2
    SINGULAR = 3
    NOT_CONVERGED = 4
    NO_REST = 5
    UNDECIDED = 6

    @classmethod
    def _missing_(cls, value: object) -> "Status":
        known = ", ".join(f"{int(status)} ({status.word})" for status in cls)
        raise InputError(f"there is no status {shorten(value)}; choose from {known}.")

    @property
    def word(self) -> str:
        """As written in JSON and tables: ok, out_of_reach, joint_limit, singular, not_converged, no_rest, undecided."""
        return self.name.lower()

    @property
    def phrase(self) -> str:
        """The words for people: ok, out of reach, joint limit, singular, not converged, no rest, undecided."""
        return self.word.replace("_", " ")

    @property
    def sentence(self) -> str:
        """A sentence for people."""
        return _SENTENCES[self]


PLACELESS = (Status.OUT_OF_REACH, Status.NOT_CONVERGED)
"""Statuses of poses at which the machine has no place."""
REGULAR = (Status.OK, Status.JOINT_LIMIT)
"""Statuses of poses at which K and C exist, whether or not the limits allow the pose."""

_SENTENCES = {
    Status.OK: "The pose can be reached and the machine resists every load.",
    Status.OUT_OF_REACH: "A leg is too short or too long to close.",
    Status.JOINT_LIMIT: "A leg, a joint or an actuator is beyond its limit.",
    Status.SINGULAR: "The machine is singular: in some direction its legs cannot hold the platform or cannot move it.",
    Status.NOT_CONVERGED: "No way from the home pose leads here on which the legs stay closed and keep their assembly "
    "mode, of those that were tried; yet nothing shows that there is none. The pose may lie behind a singularity or in "
    "another assembly mode: move it nearer to the home pose, or write the machine down at a home pose nearer to it.",
    Status.NO_REST: "The machine comes to no rest under its loads: reduce them, or preload what only pulls.",
    Status.UNDECIDED: "Rigid parts of several legs hold the platform against the same motion, but not exactly so: "
    "their axes differ by more than round-off and by too little to count, so that it is undecided which of them share "
    "a load. Write points and axes with all their digits, give a link or a bearing of each leg its stiffness, or move "
    "the pose.",
}
