"""The CUDA driver through ctypes: memory, kernels, launches. Knows no graph.

Source: CUDA Driver API reference; the functions used are there since CUDA 4, the driver's library comes with the GPU.
"""

import ctypes
import sys
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy.typing as npt

from kinetostat.spec.errors import InputError

LIBRARY = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"

Place = ctypes.c_uint64
"""An address on the device."""


class Gpu:
    """The first GPU of this machine."""

    def __init__(self, cuda: Any) -> None:
        self._cuda = cuda
        self._device, self._context = ctypes.c_int(), ctypes.c_void_p()
        self._call("cuInit", 0)
        self._call("cuDeviceGet", ctypes.byref(self._device), 0)
        self._call("cuDevicePrimaryCtxRetain", ctypes.byref(self._context), self._device)

    @property
    def name(self) -> str:
        """What its maker calls it."""
        text = ctypes.create_string_buffer(128)
        self._call("cuDeviceGetName", text, len(text), self._device)
        return text.value.decode()

    def load(self, ptx: str, name: str) -> ctypes.c_void_p:
        """A kernel of a PTX program, compiled for this device by the driver."""
        module, kernel = ctypes.c_void_p(), ctypes.c_void_p()
        self._enter()
        self._call("cuModuleLoadData", ctypes.byref(module), ctypes.c_char_p(ptx.encode()))
        self._call("cuModuleGetFunction", ctypes.byref(kernel), module, ctypes.c_char_p(name.encode()))
        return kernel

    def put(self, arrays: Sequence[npt.NDArray[Any]]) -> Place:
        """Copy contiguous arrays to the device, one behind the other; where they lie."""
        place = self.room(sum(array.nbytes for array in arrays))
        at = place.value
        for array in arrays:
            self._call("cuMemcpyHtoD_v2", Place(at), _address(array), ctypes.c_size_t(array.nbytes))
            at += array.nbytes
        return place

    def room(self, size: int) -> Place:
        """Room for so many bytes on the device."""
        place = Place()
        self._enter()
        self._call("cuMemAlloc_v2", ctypes.byref(place), ctypes.c_size_t(max(size, 1)))
        return place

    def launch(self, kernel: ctypes.c_void_p, block: int, pointers: Sequence[Place], count: int) -> None:
        """Run a kernel over so many points and wait for its end."""
        held = [*pointers, ctypes.c_int64(count)]
        arguments = (ctypes.c_void_p * len(held))(*(ctypes.addressof(one) for one in held))
        blocks = -(-count // block)
        self._enter()
        self._call("cuLaunchKernel", kernel, blocks, 1, 1, block, 1, 1, 0, None, arguments, None)
        self._call("cuCtxSynchronize")

    def take(self, place: Place, arrays: Sequence[npt.NDArray[Any]]) -> None:
        """Copy what lies at a place back into contiguous arrays."""
        at = place.value
        for array in arrays:
            self._call("cuMemcpyDtoH_v2", _address(array), Place(at), ctypes.c_size_t(array.nbytes))
            at += array.nbytes

    def free(self, places: Sequence[Place]) -> None:
        """Give rooms back."""
        for place in places:
            self._call("cuMemFree_v2", place)

    def _enter(self) -> None:
        """Make the device's context that of this thread."""
        self._call("cuCtxSetCurrent", self._context)

    def _call(self, function: str, *arguments: Any) -> None:
        """Call the driver.

        Raises:
            InputError: it reports an error.
        """
        code = getattr(self._cuda, function)(*arguments)
        if code:
            said = ctypes.c_char_p()
            self._cuda.cuGetErrorString(code, ctypes.byref(said))
            reason = (said.value or b"unknown error").decode()
            raise InputError(f'the GPU answers "{reason}" ({function}, code {code}); compute on the processor instead.')


def _address(array: npt.NDArray[Any]) -> ctypes.c_void_p:
    if not array.flags.c_contiguous:
        raise ValueError("what is copied to or from a device must be contiguous")
    return ctypes.c_void_p(array.__array_interface__["data"][0])


@cache
def gpu() -> Gpu:
    """The first GPU of this machine.

    Raises:
        InputError: there is none, or its driver is not installed.
    """
    try:
        return Gpu(ctypes.CDLL(LIBRARY))
    except OSError:
        raise InputError(
            f"no CUDA driver ({LIBRARY}) was found on this machine; compute on the processor instead."
        ) from None


def here() -> bool:
    """Whether this machine has a GPU that answers."""
    try:
        gpu()
    except InputError:
        return False
    return True
