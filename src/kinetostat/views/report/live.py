"""The machine in three dimensions for a page without any request: the renderer and the scene, packed into one text."""

import gzip
import json
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from kinetostat.views.scene import browser
from kinetostat.views.scene.looks import looks_data

SCRIPT = Path(__file__).with_name("live.js")
WITHOUT = f" For a machine that turns under the mouse, make the report after {browser.INSTALL}."
"""What a page says that cannot show it."""


@cache
def renderer() -> dict[str, str] | None:
    """The renderer's modules by name; None without their libraries."""
    return browser.modules()


def can_be_live() -> bool:
    """Whether the renderer's libraries are installed."""
    return renderer() is not None


def live_html(scene: Mapping[str, Any]) -> str:
    """Elements that unpack the renderer and show a scene in the element with the id "live"; empty without libraries."""
    modules = renderer()
    if modules is None:
        return ""
    data = json.dumps(
        {"modules": modules, "looks": looks_data(), **scene}, ensure_ascii=False, separators=(",", ":")
    ).encode()
    packed = b64encode(gzip.compress(data, 9, mtime=0)).decode()
    script = SCRIPT.read_text("utf-8")
    return f'<script type="text/plain" id="live-data">{packed}</script>\n<script>\n{script}</script>'
