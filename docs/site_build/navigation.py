"""The order of the pages, in groups."""

from pathlib import Path

PAGES = {
    "Start": ["start"],
    "Tutorials": [f"tutorials/{name}" for name in ("paper-machine", "own-machine", "read-a-map", "optimise", "jupyter")],
    "Do": ["leg-by-leg", "how-to-choose-a-link-model", "guidelines", "workspace", "design", "studio"],
    "Know": ["theory", "verification", "validation", "performance"],
    "Look up": ["gallery", "api", "faq", "extending", "changelog"],
}
"""By the heading of their group."""


def contents(_folder: Path) -> str:
    """The table of contents of the front page."""
    groups = []
    for caption, pages in PAGES.items():
        groups += ["```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""]
    return "\n".join(groups)


def changelog(folder: Path) -> str:
    """The project's changelog without its title."""
    return (folder.parent / "CHANGELOG.md").read_text("utf-8").partition("\n")[2]
