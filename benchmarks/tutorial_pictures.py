"""The pictures at the head of README and of the tutorials: the machine that each is about.

Run `python benchmarks/tutorial_pictures.py`; writes docs/images/.
"""

import sys
from io import BytesIO
from pathlib import Path

from PIL import Image

from kinetostat import build, load, load_problem, machine_picture, optimize
from kinetostat.machine.machine import Machine

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT / "tests"))
from pages import blocks  # noqa: E402  (of the tests)

SIZE = (760, 440)
HIDDEN = ("frames", "labels", "springs")
"""Layers that these pictures leave out."""
PAPER = "zhang-gosselin-4dof"


def five_bar() -> Machine:
    """The machine file that the tutorial on machines of your own shows."""
    page = ROOT / "docs" / "tutorials" / "own-machine.md"
    return build(next(block.text for block in blocks(page) if block.words == ("five-bar.toml",)), "five-bar.toml")


def keep(name: str, *machines: Machine) -> None:
    """Write a small PNG of machines beside each other."""
    width, height = SIZE[0] // len(machines), SIZE[1]
    image = Image.new("RGB", (width * len(machines), height))
    for i, machine in enumerate(machines):
        drawn = machine_picture(machine, (width, height), hidden=HIDDEN)
        image.paste(Image.open(BytesIO(drawn)).convert("RGB"), (i * width, 0))
    path = ROOT / "docs" / "images" / f"{name}.png"
    image.quantize(128).save(path, optimize=True)
    print(f"docs/images/{path.name}  {path.stat().st_size >> 10} KiB")


if __name__ == "__main__":
    keep("real-hexapod", load("hexapod-hardware"))
    keep("five-bar", five_bar())
    keep("paper-machine", load(PAPER))
    keep("tricept", load("tricept"))
    keep("better-design", load(PAPER), optimize(load_problem("zhang-gosselin-2002", ["optimizer.seed=3"])).machine)
