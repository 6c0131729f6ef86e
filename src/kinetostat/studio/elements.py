"""The page's own elements: the machine in three dimensions, maps, curves, and a number with its slider."""

from pathlib import Path

import nicegui.elements.scene  # noqa: F401  (registers three.js, which NiceGUI brings with it)
from nicegui.element import Element

from kinetostat.views.scene.browser import RENDERER
from kinetostat.views.scene.looks import looks_data

COMPONENTS = Path(__file__).parent / "components"
MODULES = {"kinetostat-studio": str(COMPONENTS), "kinetostat-scene": str(RENDERER)}


class MachineView(Element, component=RENDERER / "machine_view.js", esm=MODULES):
    """Scenes of solids, with light, shadows and a camera; methods `show`, `overlay`, `look`."""

    def __init__(self, label: str) -> None:
        """An empty view; `label` says what it shows to those who do not see it."""
        super().__init__()
        self._props["label"] = label
        self._props["hidden"] = []
        self._props["looks"] = looks_data()

    def hide(self, layers: list[str]) -> None:
        """Show all layers but these."""
        self._props["hidden"] = layers
        self.update()


class MapView(Element, component=COMPONENTS / "map_view.js"):
    """A map with a mark; methods `show`, `mark`; events `pick` with x and y, and `settle`."""

    def __init__(self, label: str) -> None:
        """An empty map."""
        super().__init__()
        self._props["label"] = label


class CurveView(Element, component=COMPONENTS / "curve_view.js"):
    """Curves over one number; method `show`."""

    def __init__(self, label: str) -> None:
        """No curves yet."""
        super().__init__()
        self._props["label"] = label


class FrontView(Element, component=COMPONENTS / "front_view.js"):
    """Designs as points over two objectives; method `show`; event `pick` with the number of a point."""

    def __init__(self, label: str) -> None:
        """No points yet."""
        super().__init__()
        self._props["label"] = label


class DesignTable(Element, component=COMPONENTS / "design_table.js"):
    """Designs as rows that sort by any column; event `pick` with the number of a design."""

    def __init__(self, label: str) -> None:
        """No rows yet."""
        super().__init__()
        self._props.update(label=label, names=[], values=[], texts=[], knee=0, chosen=None)

    def put(
        self, names: list[str], values: list[list[float]], texts: list[list[str]], knee: int, chosen: int | None
    ) -> None:
        """Show designs: names of columns, numbers to sort by and texts to read, each [designs x columns]."""
        self._props.update(names=names, values=values, texts=texts, knee=knee, chosen=chosen)
        self.update()


class QuantityRow(Element, component=COMPONENTS / "quantity_row.js"):
    """A number with its name and unit, and a slider; events `slide`, `settle`, `write`."""

    def __init__(self, label: str, meaning: str, steps: int, slides: bool) -> None:
        """A row without a value yet; `steps` positions of its slider, if it has one."""
        super().__init__()
        self._props.update(label=label, meaning=meaning, steps=steps, slides=slides, text="", position=0, problem="")

    def put(self, text: str, position: int) -> None:
        """Show a value and where its slider stands; what was wrong before is right now."""
        self._set(text=text, position=position, problem="")

    def complain(self, problem: str) -> None:
        """Say what is wrong with what was asked for."""
        self._set(problem=problem)

    def _set(self, **props: object) -> None:
        if any(self._props[name] != value for name, value in props.items()):
            self._props.update(props)
            self.update()
