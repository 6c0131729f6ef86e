"""The small pictures in the studio's gallery: every bundled machine, as `kinetostat.picture` draws it.

Run `python benchmarks/gallery_pictures.py [NAME ...]`; writes src/kinetostat/studio/gallery_pictures/*.webp.
"""

import sys
from io import BytesIO

from PIL import Image

from kinetostat.machine.loading import bundled, load
from kinetostat.studio.menus import PICTURES
from kinetostat.views.picture import machine_picture

SIZE = (240, 180)
"""Pixels of a picture."""
QUALITY = 70
"""Of the compression, from 0 to 100."""


def main() -> None:
    """Make the pictures of these machines, or of all."""
    for name in sys.argv[1:] or bundled():
        target = PICTURES / f"{name}.webp"
        Image.open(BytesIO(machine_picture(load(name), SIZE, transparent=True))).save(target, quality=QUALITY, method=6)
        print(f"{target.name}  {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
