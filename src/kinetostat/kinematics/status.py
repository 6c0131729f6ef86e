"""The status of a pose: a number in arrays and files, a word in tables, a sentence for people."""

from enum import IntEnum


class Status(IntEnum):
    """What became of a pose. Only `OK` carries results; the others say why there are none."""

    OK = 0
    OUT_OF_REACH = 1
    JOINT_LIMIT = 2
    SINGULAR = 3
    NOT_CONVERGED = 4

    @property
    def word(self) -> str:
        """As written in JSON and tables: ok, out_of_reach, joint_limit, singular, not_converged."""
        return self.name.lower()

    @property
    def sentence(self) -> str:
        """What it means."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.OK: "The pose can be reached and the machine resists every load.",
    Status.OUT_OF_REACH: "A leg is too short or too long to close.",
    Status.JOINT_LIMIT: "A leg, a joint or an actuator is beyond its limit.",
    Status.SINGULAR: "The machine is singular: some load finds no unique answer in its legs.",
    Status.NOT_CONVERGED: "The position of the passive joints could not be computed.",
}
