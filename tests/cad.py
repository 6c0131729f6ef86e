"""Whether Open CASCADE starts here: it needs libraries of the system that a machine without a screen may lack."""

from functools import cache
from importlib import import_module

import pytest


@cache
def starts() -> bool:
    try:
        import_module("OCP.STEPCAFControl")
    except ImportError:
        return False
    return True


needs_cad = pytest.mark.skipif(not starts(), reason="Open CASCADE is not installed, or lacks libGL or libX11")
