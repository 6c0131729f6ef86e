"""Everything that one pose shows: compliance, load and deflected shape over the machine. No renderer is known here."""

from kinetostat.algebra.screw import Wrench
from kinetostat.algebra.vector import Vector
from kinetostat.kinetostatics.deflected import deflected_links
from kinetostat.kinetostatics.loading import deflection
from kinetostat.kinetostatics.response import respond
from kinetostat.studies.analysis import Analysis
from kinetostat.views.scene import machine_scene as scenes
from kinetostat.views.scene.profiles import Proportions
from kinetostat.views.scene.solids import Solid


def overlays_of(found: Analysis, sizes: Proportions, factor: float | None = None) -> tuple[list[Solid], float | None]:
    """The overlays of an analysis, and by which factor its deflected shape is exaggerated; None without a load.

    Args:
        found: in base axes; nothing is drawn of a pose without an answer.
        sizes: from `machine_scene.proportions_of`.
        factor: of exaggeration; None to choose a round one.
    """
    if found.indices is None:
        return [], None
    machine, response = found.machine, respond(found.machine)
    solids = scenes.response_overlays(machine, response.configuration, sizes, found.indices.principal_compliances)
    if found.load is None:
        return solids, None
    load = Wrench(Vector(*found.load.wrench[:3]), Vector(*found.load.wrench[3:]))
    moved = scenes.Deflection(load, deflection(response.compliance, load), tuple(deflected_links(response, load)))
    ghost, chosen = scenes.deflection_overlays(machine, response.configuration, sizes, moved, factor)
    return solids + ghost, chosen
