"""All questions by their word, with a phrase that says what is computed, and where they live. Nothing is imported."""

from collections.abc import Mapping

QUESTIONS: Mapping[str, tuple[str, str]] = {
    "forward": ("compute the poses that actuator coordinates give", "views.forward.FORWARD"),
    "modes": ("compute natural frequencies and modes, and the receptance of the tool", "views.vibration.MODES"),
    "budget": (
        "compute the error of the tool that tolerances allow, and what it is made of",
        "views.budget.QUESTION",
    ),
    "command": (
        "compute where actuators must stand to bring a loaded tool to its pose",
        "views.command.QUESTION",
    ),
    "identify": (
        "find the errors of a machine as built that explain what was measured of it",
        "views.identification.QUESTION",
    ),
}
"""Word, which is the command and the Python function; phrase; and the place of the `Question` in kinetostat."""
