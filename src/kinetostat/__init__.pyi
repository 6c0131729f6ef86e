"""Types of the package's names, for editors and type checkers; `__init__.py` loads them when they are used."""

from typing import Any

from kinetostat.equilibrium.state import state_of as state_of
from kinetostat.exchange.formats import export as export
from kinetostat.kinematics.status import Status as Status
from kinetostat.machine.catalogue import register as register
from kinetostat.machine.loading import build as build
from kinetostat.machine.loading import bundled as bundled
from kinetostat.machine.loading import changed as changed
from kinetostat.machine.loading import load as load
from kinetostat.machine.machine import Machine as Machine
from kinetostat.spec.errors import InputError as InputError
from kinetostat.studies.analysis import analyze as analyze
from kinetostat.studies.assembly_modes import forward as forward
from kinetostat.studies.budget import budget as budget
from kinetostat.studies.capability import capability as capability
from kinetostat.studies.commanding import command as command
from kinetostat.studies.comparison import compare as compare
from kinetostat.studies.control import servo as servo
from kinetostat.studies.control import state_space as state_space
from kinetostat.studies.corrections import correction_table as correction_table
from kinetostat.studies.datasets import evaluate as evaluate
from kinetostat.studies.datasets import evaluate_grid as evaluate_grid
from kinetostat.studies.drives import drives as drives
from kinetostat.studies.dynamics import dynamics as dynamics
from kinetostat.studies.elevation import elevation as elevation
from kinetostat.studies.evaluation import compile as compile  # noqa: A004
from kinetostat.studies.guidelines import guidelines as guidelines
from kinetostat.studies.identification.identification import identify as identify
from kinetostat.studies.lobes import lobes as lobes
from kinetostat.studies.measured_stiffness import validate_measured as validate_measured
from kinetostat.studies.motors import motors as motors
from kinetostat.studies.optimisation.problem import load_problem as load_problem
from kinetostat.studies.optimisation.search import optimize as optimize
from kinetostat.studies.reproduction import reproduce as reproduce
from kinetostat.studies.requirements import requirements as requirements
from kinetostat.studies.sensitivity import sensitivity as sensitivity
from kinetostat.studies.tensions import carrying_legs as carrying_legs
from kinetostat.studies.tensions import tensions as tensions
from kinetostat.studies.under_load import under_load as under_load
from kinetostat.studies.vibration import modes as modes
from kinetostat.studies.workspace import workspace as workspace
from kinetostat.validation.comparison import validate as validate
from kinetostat.views.answers import plot as plot
from kinetostat.views.answers import save as save
from kinetostat.views.picture import machine_picture as machine_picture
from kinetostat.views.report.writing import report as report

STARTED: float

def load_ipython_extension(shell: Any) -> None: ...
