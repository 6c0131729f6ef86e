"""Words on a picture: numbers of legs in white discs, letters of frames on a halo."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from kinetostat.views.rendering.camera import Camera
from kinetostat.views.scene.solids import Label

FONT = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans-Bold.ttf"
HEIGHT = 0.017
"""Of letters, as a share of the picture's shorter side."""
SMALLEST = 9
"""Height of letters, pixels."""
INK, DISC, RIM = (20, 28, 38, 255), (255, 255, 255, 235), (120, 132, 146, 255)


def draw_labels(image: Image.Image, labels: Sequence[Label], camera: Camera) -> None:
    """Write labels over a picture that a camera took."""
    if not labels:
        return
    size = max(SMALLEST, round(HEIGHT * min(camera.width, camera.height)))
    pen, font = ImageDraw.Draw(image, "RGBA"), ImageFont.truetype(str(FONT), size)
    places, _ = camera.project(np.array([label.point.components() for label in labels], dtype=float))
    for label, (x, y) in zip(labels, places.tolist(), strict=True):
        if label.layer == "labels":
            reach = 0.5 * pen.textlength(label.text, font) + 0.45 * size
            reach = max(reach, 0.95 * size)
            box = (x - reach, y - 0.95 * size, x + reach, y + 0.95 * size)
            pen.rounded_rectangle(box, 0.95 * size, fill=DISC, outline=RIM, width=max(1, size // 14))
            pen.text((x, y), label.text, INK, font, anchor="mm")
        else:
            pen.text((x, y), label.text, INK, font, anchor="mm", stroke_width=max(1, size // 8), stroke_fill=DISC)
