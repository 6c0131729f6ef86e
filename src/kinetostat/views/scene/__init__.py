"""A machine as a scene: solids with places, materials and names, which pages, reports and CAD files show.

The folder `browser` has the renderer of scenes for browsers, in JavaScript; the libraries that it needs come with
NiceGUI.
"""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

RENDERER = Path(__file__).parent / "browser"
"""Folder of the renderer's modules, which import each other as "kinetostat-scene/..."."""
OWN_MODULES = ("handles.js", "machine_view.js", "solid_geometry.js", "swing.js", "theme.js")
LIBRARIES = {"nicegui-scene": "elements/scene/dist/index.js", "vue": "static/vue.esm-browser.prod.js"}
"""three.js with its controls, and Vue, as files of the package nicegui, by the name under which they are imported."""


@cache
def renderer_modules() -> dict[str, str] | None:
    """Return the text of every module that draws a scene, by the name under which it is imported; None without NiceGUI.

    They are read once in a process.
    """
    package = find_spec("nicegui")
    if package is None or package.origin is None:
        return None
    libraries = {name: Path(package.origin).parent / path for name, path in LIBRARIES.items()}
    if not all(path.exists() for path in libraries.values()):
        return None
    files = {**libraries, **{f"kinetostat-scene/{name}": RENDERER / name for name in OWN_MODULES}}
    return {name: path.read_text("utf-8") for name, path in files.items()}
