"""What programs run on."""

from enum import Enum


class Device(Enum):
    """A kind of processor: the one at hand, or an NVIDIA GPU beside it."""

    CPU = "cpu"
    GPU = "gpu"
