"""K and C as tables, to read and to copy."""

from nicegui import ui

from kinetostat.studies.analysis import Analysis
from kinetostat.studio.answers import Report
from kinetostat.studio.markup import paragraph, table
from kinetostat.studio.session import Session
from kinetostat.studio.wording import scientific
from kinetostat.views.analysis_tables import UNITS_OF_C, UNITS_OF_K

KINDS = {"C": "compliance", "K": "stiffness"}
UNITS = {"C": UNITS_OF_C, "K": UNITS_OF_K}


class MatricesPanel:
    """One matrix at a time, in four digits; copied in all digits."""

    name = "Matrices"

    def build(self) -> None:
        """The choice of a matrix, a button to copy it, and the table."""
        self._report: Report | None = None
        with ui.row().classes("panel-tools"):
            self.kind = ui.toggle(list(KINDS), value="C", on_change=self._draw).props(
                "dense no-caps unelevated toggle-text-color=accent-ink"
            )
            self.kind.mark("matrix-kind").classes("choice")
            ui.space()
            copy = ui.button("Copy", icon="content_copy", on_click=self._copy).props("flat dense no-caps")
            copy.mark("matrix-copy").tooltip("all digits, separated by tabs, as spreadsheets take them")
        self.table = ui.html("", sanitize=False).mark("matrix-table")

    def show(self, report: Report, _session: Session) -> None:
        """Show the matrices of a new analysis."""
        self._report = report
        self._draw()

    def close(self) -> None:
        """Nothing is under way."""

    def _draw(self) -> None:
        if self._report is not None:
            self.table.set_content(matrix_table(self._report.analysis, str(self.kind.value)))

    def _copy(self) -> None:
        if self._report is not None:
            ui.clipboard.write(matrix_text(self._report.analysis, str(self.kind.value)))
            ui.notify(f"{self.kind.value} copied", position="bottom", timeout=1500)


def _rows(analysis: Analysis, kind: str) -> list[list[float]] | None:
    return analysis.compliance if kind == "C" else analysis.stiffness


def matrix_table(analysis: Analysis, kind: str) -> str:
    """C or K as a table; only the diagonal where the rest has no finite value."""
    names, rows = analysis.components, _rows(analysis, kind)
    title = f"{KINDS[kind]} matrix {kind}"
    if rows is not None:
        body = [[name, *(scientific(entry) for entry in row)] for name, row in zip(names, rows, strict=True)]
        return table(title, ["", *names], body, "matrix") + paragraph(UNITS[kind])
    diagonal = analysis.compliance_diagonal if kind == "C" else analysis.stiffness_diagonal
    body = [[name, scientific(entry)] for name, entry in zip(names, diagonal, strict=True)]
    why = "A part is free" if kind == "C" else "A part is rigid"
    return paragraph(f"{why}: {kind} is not finite; its diagonal is") + table(title, ["", "diagonal"], body, "matrix")


def matrix_text(analysis: Analysis, kind: str) -> str:
    """The matrix in all digits, cells separated by tabs; the diagonal where there is no more."""
    rows = _rows(analysis, kind)
    if rows is None:
        diagonal = analysis.compliance_diagonal if kind == "C" else analysis.stiffness_diagonal
        rows = [[entry] for entry in diagonal]
    return "\n".join("\t".join(repr(entry) for entry in row) for row in rows)
