"""The order of the pages, in groups."""

from pathlib import Path

TUTORIALS = (
    "paper-machine",
    "own-machine",
    "real-hexapod",
    "read-a-map",
    "optimise",
    "calibrate",
    "cable-robot",
    "delta-printer",
    "telescope",
    "machine-tool",
    "jupyter",
)
PAGES = {
    "Start": ["start", "overview", "install"],
    "Tutorials": [*(f"tutorials/{name}" for name in TUTORIALS), "exercises"],
    "Do": [
        "leg-by-leg",
        "how-to-choose-a-link-model",
        "guidelines",
        "workspace",
        "poses",
        "functions",
        "loads",
        "capability",
        "drives",
        "vibration",
        "servo",
        "budget",
        "calibration",
        "design",
        "report",
        "export",
        "studio",
    ],
    "Know": ["theory", "verification", "validation", "performance"],
    "Look up": ["gallery", "glossary", "python", "api", "faq", "extending", "changelog"],
}
"""By the heading of their group."""


def contents(folder: Path) -> str:
    """The table of contents of the front page."""
    groups = []
    for caption, pages in PAGES.items():
        written = [page for page in pages if (folder / f"{page}.md").exists()]
        groups += ["```{toctree}", ":hidden:", f":caption: {caption}", "", *written, "```", ""]
    return "\n".join(groups)


def changelog(folder: Path) -> str:
    """The project's changelog without its title."""
    return (folder.parent / "CHANGELOG.md").read_text("utf-8").partition("\n")[2]
