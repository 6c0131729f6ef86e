"""All questions and all described answers: what they are called, and where they live. Nothing is imported here."""

from collections.abc import Mapping

QUESTION_GROUPS: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "at a pose": {
        "analyze": (
            "compute stiffness, compliance, attribution and indices at a pose",
            "views.analysis.ANALYZE_QUESTION",
        ),
        "forward": ("compute the poses that actuator coordinates give", "views.forward.FORWARD_QUESTION"),
        "sensitivity": (
            "rank the parameters by their effect on the stiffness at a pose",
            "views.sensitivity.SENSITIVITY_QUESTION",
        ),
        "guidelines": (
            "show what stiffness depends on, what counts as rigid, what to change",
            "views.guidelines.GUIDELINES_QUESTION",
        ),
        "tensions": (
            "compute the tensions of cables, their sag, and what they can hold besides",
            "views.tensions.TENSIONS_QUESTION",
        ),
        "capability": (
            "compute the forces, moments and speeds that the drives allow at a pose",
            "views.capability.CAPABILITY_QUESTION",
        ),
    },
    "at many poses": {
        "path": ("compute quantities at the poses of a CSV file: table, CSV and picture", "views.path.PATH_QUESTION"),
        "sweep": ("compute quantities along one parameter: table, curves and NetCDF", "views.grid.SWEEP_QUESTION"),
        "map": ("compute quantities over two to six parameters: contour maps and NetCDF", "views.grid.MAP_QUESTION"),
        "workspace": (
            "compute where the machine can work: volume, limits, pictures",
            "views.workspace.WORKSPACE_QUESTION",
        ),
    },
    "under load and in motion": {
        "command": (
            "compute where actuators must stand to bring a loaded tool to its pose",
            "views.command.COMMAND_QUESTION",
        ),
        "elevation": (
            "compute what gravity does to a tilting machine over its elevation",
            "views.elevation.ELEVATION_QUESTION",
        ),
        "modes": (
            "compute natural frequencies and modes, and the receptance of the tool",
            "views.vibration.MODES_QUESTION",
        ),
        "servo": (
            "compute the stiffness and the damping of the tool with servo loops closed",
            "views.servo.SERVO_QUESTION",
        ),
        "lobes": (
            "compute the width of cut that stays stable over the speed of the spindle",
            "views.lobes.LOBES_QUESTION",
        ),
        "drives": (
            "compute what a motion asks of the drives: force, speed, power and energy",
            "views.drives.DRIVES_QUESTION",
        ),
        "motors": (
            "compare the motors of a catalogue with what a motion asks of the drives",
            "views.motors.MOTORS_QUESTION",
        ),
    },
    "as built": {
        "budget": (
            "compute the error of the tool that tolerances allow, and what it is made of",
            "views.budget.BUDGET_QUESTION",
        ),
        "identify": (
            "find the errors of a machine as built that explain what was measured of it",
            "views.identification.IDENTIFY_QUESTION",
        ),
    },
}
"""By group: the word, which is the command and the Python function; a phrase; the place of the `Question`."""
QUESTIONS = {word: place for group in QUESTION_GROUPS.values() for word, place in group.items()}

ANSWERS: Mapping[str, str] = {
    "studies.analysis.Analysis": "views.analysis.ANALYSIS",
    "studies.assembly_modes.Forward": "views.forward.FORWARD",
    "studies.under_load.LoadedState": "views.analysis.LOADED",
    "studies.tensions.Tensions": "views.tensions.TENSIONS",
    "studies.drives.DriveLoads": "views.drives.DRIVES",
    "studies.vibration.Vibration": "views.vibration.VIBRATION",
    "studies.evaluation.PoseAnswers": "views.path.PATH",
    "xarray.Dataset": "views.grid.GRID",
    "studies.stored_grid.StoredGrid": "views.grid.STORED_GRID",
    "studies.tensions.Carrying": "views.grid.CARRYING",
    "studies.workspace.Workspace": "views.workspace.WORKSPACE",
    "studies.sensitivity.Sensitivity": "views.sensitivity.SENSITIVITY",
    "studies.identification.identification.Identification": "views.identification.IDENTIFICATION",
    "studies.guidelines.Guidelines": "views.guidelines.GUIDELINES",
    "studies.commanding.Command": "views.command.COMMAND",
    "studies.corrections.CorrectionTable": "views.command.CORRECTIONS",
    "studies.elevation.Elevation": "views.elevation.ELEVATION",
    "studies.motors.MotorChoice": "views.motors.MOTORS",
    "studies.control.Servo": "views.servo.SERVO",
    "studies.lobes.Lobes": "views.lobes.LOBES",
    "studies.capability.Capability": "views.capability.CAPABILITY",
    "studies.budget.Budget": "views.budget.BUDGET",
    "accuracy.toleranced_parts.PossibleErrors": "views.budget.POSSIBLE_ERRORS",
    "studies.measured_stiffness.MeasuredComparison": "views.validation.MEASURED_STIFFNESS",
    "validation.comparison.Validation": "views.validation.VALIDATION",
    "studies.optimisation.result.Result": "views.optimisation.RESULT",
    "studies.reproduction.Reproduction": "views.paper.REPRODUCTION",
    "studies.comparison.Comparison": "views.comparison.COMPARISON",
}
"""Place of the `Description` of each class of answers."""
