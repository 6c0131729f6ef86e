"""The pictures of README and of the tutorials: the machine that each is about, and maps.

Run `python benchmarks/tutorial_pictures.py`; writes docs/images/.
"""

import sys
from contextlib import chdir
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from kinetostat import build, elevation, evaluate_grid, load, load_problem, machine_picture, optimize, plot
from kinetostat.cli import main
from kinetostat.machine.machine import Machine

ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT / "tests"))
from pages import blocks, dialogues  # noqa: E402  (of the tests)

SIZE = (760, 440)
SWEEPS = 20
"""Improvements of the palette: without them, rare colours are lost."""
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
    write(name, image)


def keep_map(name: str, degrees: int, *quantities: str) -> None:
    """Write a small PNG of maps of the Tricept over both tilts."""
    grid = evaluate_grid(load("tricept"), [f"theta{i}=-{degrees} deg:{degrees} deg:41" for i in (1, 2)], quantities)
    drawn = BytesIO()
    plot(grid).savefig(drawn, dpi=180)
    write(name, Image.open(drawn).convert("RGB"))


def keep_resonance(name: str) -> None:
    """Write a small PNG of the first frequency of the delta printer over its bed."""
    grid = evaluate_grid(load("delta-linear"), ["x=-8 cm:8 cm:17", "y=-8 cm:8 cm:17"], ["frequency_1"])
    drawn = BytesIO()
    plot(grid).savefig(drawn, dpi=130)
    write(name, Image.open(drawn).convert("RGB"))


def keep_elevation(name: str) -> None:
    """Write a small PNG of the telescope of its tutorial over elevation."""
    page, drawn = ROOT / "docs" / "tutorials" / "telescope.md", BytesIO()
    text = next(block.text for block in blocks(page) if block.words == ("telescope.toml",))
    plot(elevation(build(text))).savefig(drawn, dpi=130)
    write(name, Image.open(drawn).convert("RGB"))


def keep_fit(name: str) -> None:
    """Write a small PNG of the residuals of the fit that the tutorial on calibration makes."""
    page, space, drawn = ROOT / "docs" / "tutorials" / "calibrate.md", {}, BytesIO()
    with TemporaryDirectory() as folder, chdir(folder):
        programs = [block.text for block in blocks(page) if block.kind == "python"]
        exec("\n".join(programs[: programs.index(next(p for p in programs if "whole = fit(" in p)) + 1]), space)
    plot(space["whole"], "residuals").savefig(drawn, dpi=130)
    write(name, Image.open(drawn).convert("RGB"))


def keep_mill(lobes_name: str, designs_name: str) -> None:
    """Write small PNGs of the lobes with a tool, and of the designs, of the tutorial on a machine tool."""
    page = ROOT / "docs" / "tutorials" / "machine-tool.md"
    with TemporaryDirectory() as folder, chdir(folder):
        for block in blocks(page):
            if block.kind in ("toml", "csv"):
                Path(block.words[0]).write_text(block.text, "utf-8")
            elif block.kind == "python":
                exec(block.text, {})
        lines = [words for block in blocks(page) if block.kind == "console" for words, _ in dialogues(block.text)]
        for name, word in ((lobes_name, "--tool-receptance"), (designs_name, "compare")):
            main(next(words for words in lines if word in words)[1:])
            picture = "compare" if word == "compare" else "lobes"
            write(name, Image.open(next(Path().glob(f"*/{picture}.png"))).convert("RGB").reduce(2))


def write(name: str, image: Image.Image) -> None:
    """Write a small PNG into docs/images."""
    path = ROOT / "docs" / "images" / f"{name}.png"
    image.quantize(256, kmeans=SWEEPS, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"docs/images/{path.name}  {path.stat().st_size >> 10} KiB")


if __name__ == "__main__":
    keep("delta-printer", load("delta-linear"))
    keep_resonance("delta-printer-resonance")
    keep_elevation("telescope-elevation")
    keep_mill("mill-lobes", "five-mills")
    keep("real-hexapod", load("hexapod-hardware"))
    keep("five-bar", five_bar())
    keep("paper-machine", load(PAPER))
    keep("tricept", load("tricept"))
    keep_map("tricept-map", 40, "free_stiffness_z", "stiffness_z", "singularity_margin")
    keep_map("tricept-stiffness", 25, "free_stiffness_z")
    keep_fit("calibrate-residuals")
    keep("better-design", load(PAPER), optimize(load_problem("zhang-gosselin-2002", ["optimizer.seed=3"])).machine)
