"""Programs for a GPU: their LLVM assembly run point by point on the processor, through a device made of host memory.

What a GPU's driver does with PTX is beyond these tests; that PTX is made, and that the calls of the driver are right in
order and number, is not.
"""

import ctypes
import re

import llvmlite.binding as llvm
import numpy as np
import pytest

from kinetostat.engine import batch, cuda, cuda_driver, kernel
from kinetostat.engine.batch import evaluate
from kinetostat.engine.cuda_driver import Gpu
from kinetostat.engine.device import Device
from kinetostat.engine.points import Table
from kinetostat.kinetostatics.quantities import GROUPS
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import values
from kinetostat.spec.errors import InputError
from machines import CASES, KINDS

TWELVE = (*GROUPS["compliance"], *GROUPS["stiffness"])


class HostDevice:
    """Rooms are arrays; a launch runs the kernel as the only thread of one block after another."""

    def __init__(self):
        self.rooms = 0

    def load(self, text, name):
        text = text.replace('target triple = "nvptx64-nvidia-cuda"', "@block = global i32 0")
        text = re.sub(r"declare i32 @llvm.nvvm.*\n", "", text).replace("ptx_kernel", "")
        for register, value in (("tid.x", "0"), ("ctaid.x", "load i32, ptr @block"), ("ntid.x", "1")):
            call = f"call i32 @llvm.nvvm.read.ptx.sreg.{register}()"
            text = text.replace(call, value if "load" in value else f"add i32 {value}, 0")
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine()
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
        engine.finalize_object()
        block = ctypes.c_int32.from_address(engine.get_global_value_address("block"))
        signature = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4, ctypes.c_int64)
        return engine, signature(engine.get_function_address(name)), block

    def put(self, arrays):
        self.rooms += 1
        return np.concatenate([array.ravel().view(np.uint8) for array in arrays] or [np.empty(0, np.uint8)])

    def room(self, size):
        self.rooms += 1
        return np.full(size, 255, np.uint8)

    def launch(self, kernel, block, pointers, count):
        _, call, at = kernel
        for i in range(-(-count // block) * block):
            at.value = i
            call(*(place.ctypes.data for place in pointers), count)

    def take(self, place, arrays):
        at = 0
        for array in arrays:
            array.ravel().view(np.uint8)[:] = place[at : at + array.nbytes]
            at += array.nbytes

    def free(self, places):
        self.rooms -= len(places)


def poses(case, count):
    rng = np.random.default_rng(3)
    ranges = {path: bounds for path, bounds in case.ranges.items() if path.startswith("pose.")}
    return Table({path: rng.uniform(low, high, count) for path, (low, high) in ranges.items()})


@pytest.mark.parametrize("case", [case for case in CASES if case.name in KINDS], ids=repr)
def test_a_gpu_program_gives_what_the_processor_gives(case, monkeypatch):
    device = HostDevice()
    monkeypatch.setattr(cuda, "ptx", lambda text: text)
    for module in (cuda_driver, kernel):
        monkeypatch.setattr(module, "gpu", lambda: device)
    points = poses(case, 150)
    found = evaluate(case.machine, points, (*TWELVE, "regularity"), device=Device.GPU)
    expected = evaluate(case.machine, points, (*TWELVE, "regularity"))
    np.testing.assert_array_equal(found.status, expected.status)
    assert (found.status == 0).any()
    for name in found.values:
        np.testing.assert_allclose(found.values[name], expected.values[name], rtol=1e-9, atol=1e-300, err_msg=name)
    assert device.rooms == 0, "what is taken is given back"


class Wrong(HostDevice):
    """A device whose arithmetic is off by one part in a million."""

    def take(self, place, arrays):
        super().take(place, arrays)
        for array in arrays:
            if array.dtype == float:
                array *= 1.0 + 1e-6


class Full(HostDevice):
    """A device without memory."""

    def room(self, _size):
        raise InputError("out of memory")


@pytest.mark.parametrize("make", [HostDevice, Wrong, Full])
def test_the_engine_takes_a_gpu_that_it_can_trust(make, monkeypatch):
    device, machine = make(), load("hexapod")
    points = Table({"pose.z": np.linspace(0.12, 0.15, 90)})
    expected = evaluate(machine, points, TWELVE)
    launched = []
    monkeypatch.setattr(HostDevice, "launch", lambda *given: (launched.append(given[-1]), LAUNCH(*given)))
    monkeypatch.setattr(cuda, "ptx", lambda text: text)
    for module in (cuda_driver, kernel):
        monkeypatch.setattr(module, "gpu", lambda: device)
    monkeypatch.setattr(batch, "GPU_FROM", 50)
    monkeypatch.setattr(batch, "TRIED", 20)
    found = evaluate(machine, points, TWELVE)
    assert launched == {HostDevice: [20, 90], Wrong: [20], Full: []}[make]
    for name in TWELVE:
        np.testing.assert_allclose(found.values[name], expected.values[name], rtol=1e-12)
    launched.clear()
    evaluate(machine, points, TWELVE, part=range(90))
    assert not launched, "a part is the same with and without a GPU"


LAUNCH = HostDevice.launch


@pytest.mark.parametrize("name", ["zhang-gosselin-4dof", "hexapod", "tripteron"])
def test_ptx_is_made(name, monkeypatch):
    made = []

    class Maker(HostDevice):
        def load(self, text, entry):
            made.append((text, entry))
            raise InputError("seen")

    monkeypatch.setattr(kernel, "gpu", Maker)
    machine = load(name)
    with pytest.raises(InputError, match="seen"):
        evaluate(machine, Table({"pose.z": np.array([values(machine)["pose.z"]])}), TWELVE, device=Device.GPU)
    text, entry = made[0]
    assert f".visible .entry {entry}(" in text
    assert ".target sm_70" in text
    assert text.count("st.global.b64") == len(TWELVE)


def test_without_a_gpu_one_sentence_says_so(monkeypatch):
    monkeypatch.setattr(cuda_driver, "LIBRARY", "no such library.so")
    cuda_driver.gpu.cache_clear()
    with pytest.raises(InputError, match="no CUDA driver"):
        evaluate(load("hexapod"), Table({"pose.z": np.array([0.135])}), TWELVE, device=Device.GPU)
    assert not cuda_driver.here()


class Library:
    """A CUDA driver that notes what it is asked and fails where it is told to."""

    def __init__(self, failing=""):
        self.asked, self.failing = [], failing

    def __getattr__(self, name):
        def call(*arguments):
            self.asked.append(name)
            if name == "cuGetErrorString":
                arguments[1]._obj.value = b"out of memory"
            return 2 if name == self.failing else 0

        return call


def test_calls_of_the_driver():
    library = Library()
    device, data, found = Gpu(library), np.arange(4.0), np.empty((2, 3))
    kernel = device.load("text", "kernel")
    given, room = device.put([data, data]), device.room(48)
    device.launch(kernel, 128, [given, room], 3)
    device.take(room, list(found))
    device.free([given, room])
    assert [name for name in library.asked if name != "cuCtxSetCurrent"] == [
        "cuInit", "cuDeviceGet", "cuDevicePrimaryCtxRetain", "cuModuleLoadData", "cuModuleGetFunction",
        "cuMemAlloc_v2", "cuMemcpyHtoD_v2", "cuMemcpyHtoD_v2", "cuMemAlloc_v2", "cuLaunchKernel", "cuCtxSynchronize",
        "cuMemcpyDtoH_v2", "cuMemcpyDtoH_v2", "cuMemFree_v2", "cuMemFree_v2",
    ]  # fmt: skip


def test_an_error_of_the_driver_is_one_sentence():
    device = Gpu(Library(failing="cuMemAlloc_v2"))
    with pytest.raises(InputError, match=r"out of memory.*cuMemAlloc_v2, code 2"):
        device.room(8)


def test_only_contiguous_arrays_are_copied():
    device = Gpu(Library())
    with pytest.raises(ValueError, match="contiguous"):
        device.put([np.arange(8.0)[::2]])
