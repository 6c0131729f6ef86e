"""The section with maps: how the compliance changes with the pose. Nothing is computed here."""

import xarray as xr

from kinetostat.kinematics.status import Status
from kinetostat.studies.grid.grid import failures
from kinetostat.studies.report.answers import Answers
from kinetostat.views.figures import axis_values, contour_maps, curves
from kinetostat.views.report.content import Block, Paragraph, Section, Table
from kinetostat.views.report.pictures import drawn
from kinetostat.views.report.typesetting import typeset
from kinetostat.views.tables import number

TITLE = "Over the poses"


def workspace_section(answers: Answers) -> Section:
    """Maps of the diagonal of C and their extremes."""
    if answers.maps is None:
        return Section(TITLE, (Paragraph(answers.refused.get("maps", "Maps were left out.")),))
    return Section(TITLE, tuple(_mapped(answers.maps)))


def _mapped(maps: xr.Dataset) -> list[Block]:
    names = [str(name) for name in maps.data_vars if name != "status"]
    dims = [str(dim) for dim in maps["status"].dims]
    spans = [
        f"{label} from {values.min():.6g} to {values.max():.6g}"
        for values, label in (axis_values(maps, d) for d in dims)
    ]
    count = " by ".join(str(maps.sizes[dim]) for dim in dims)
    failed = failures(maps)
    lacking = ", ".join(f"{count:,} {status.word.replace('_', ' ')}" for status, count in failed.items())
    outcome = f"of {maps['status'].size:,} poses {lacking}" if failed else "every pose has an answer"
    about = typeset(f"Over {' and '.join(spans)}: {count} points, all else as in the data sheet; {outcome}.")
    if (maps["status"] != int(Status.OK)).all():
        return [Paragraph(about)]
    draw = contour_maps if len(dims) == 2 else curves
    return [
        Paragraph(about),
        drawn(draw(maps, names, ""), "Compliance in each direction over the poses."),
        _extremes(maps, names),
    ]


def _extremes(maps: xr.Dataset, names: list[str]) -> Table:
    """The least and the greatest of each quantity, and where."""
    rows = []
    for name in names:
        known = maps[name].where(maps["status"] == int(Status.OK)).values
        if (known == known).any():
            least, most = float(maps[name].min()), float(maps[name].max())
            ratio = number(most / least) if least > 0.0 else "–"
            texts = [typeset(number(value, "free")) for value in (least, most)]
            rows.append((name.replace("_", " "), *texts, typeset(ratio), maps[name].attrs["units"]))
    heads = ("quantity", "least", "greatest", "ratio", "unit")
    return Table("Extremes over these poses.", heads, tuple(rows), (False, True, True, True, False))
