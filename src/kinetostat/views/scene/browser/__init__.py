"""The renderer of scenes for browsers, in JavaScript, and the libraries it stands on, which NiceGUI brings with it."""

from importlib.util import find_spec
from pathlib import Path

RENDERER = Path(__file__).parent
"""Folder of its modules, which import each other as "kinetostat-scene/..."."""
OURS = ("handles.js", "machine_view.js", "solid_geometry.js", "swing.js", "theme.js")
BROUGHT = {"nicegui-scene": "elements/scene/dist/index.js", "vue": "static/vue.esm-browser.prod.js"}
"""three.js with its controls, and Vue, as files of the package nicegui, by the name under which they are imported."""


def modules() -> dict[str, str] | None:
    """The text of every module that draws a scene, by the name under which it is imported; None without NiceGUI."""
    package = find_spec("nicegui")
    if package is None or package.origin is None:
        return None
    brought = {name: Path(package.origin).parent / path for name, path in BROUGHT.items()}
    if not all(path.exists() for path in brought.values()):
        return None
    files = {**brought, **{f"kinetostat-scene/{name}": RENDERER / name for name in OURS}}
    return {name: path.read_text("utf-8") for name, path in files.items()}
