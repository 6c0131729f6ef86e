"""The compiled kernel: one slab of points in one XLA program. The only module that imports JAX.

Measured on two AVX2 cores for the 4-dof machine: XLA's default fusion repeats the whole chain for each output
(5 million poses/s for twelve); with multi-output fusion and blocks of 128 to 256 points, whose intermediate arrays stay
in the first cache levels, 8 to 9 million. Trigonometry inside the loop keeps LLVM from vectorising it, so angles come
in as cosine and sine.
"""

import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

FUSION = "--xla_backend_extra_options=xla_cpu_use_multi_output_fusion=true"
if "xla_backend_extra_options" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {FUSION}".strip()

import jax  # noqa: E402  XLA reads its flags when JAX is first imported
import numpy as np  # noqa: E402

from kinetostat.algebra.scalar import Angle  # noqa: E402
from kinetostat.kinetostatics.quantities import QUANTITIES  # noqa: E402
from kinetostat.kinetostatics.response import respond  # noqa: E402
from kinetostat.machine.machine import Machine  # noqa: E402
from kinetostat.machine.parameters import with_values  # noqa: E402

BLOCK = 256
"""Points that run through the formulas together: 256 x 8 bytes x some hundred intermediates fit the second cache."""
SLAB = 64 * BLOCK
"""Points in one call: long enough to hide its overhead, short enough to share among threads."""

Parameters = Mapping[str, Any]


def cache_folder() -> Path:
    """Where compiled programs are kept between runs."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "kinetostat" / "xla"


@cache
def _configure() -> None:
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_compilation_cache_dir", str(cache_folder()))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    jax.tree_util.register_dataclass(Angle, ["cos", "sin"], [])


def slab_kernel(
    machine: Machine, quantities: tuple[str, ...]
) -> Callable[[Parameters, Parameters], tuple[list[Any], Any]]:
    """The program for one slab of a family.

    Args:
        machine: any machine of the family; its values are not used.
        quantities: names from `QUANTITIES`.

    Returns:
        A function of the fixed parameters (scalars by leaf path) and the varying ones (arrays of `SLAB`), angles as
        `Angle`, that gives one array per quantity and the status codes.
    """
    _configure()
    return _kernel(machine.family.name, quantities, machine)


_kernels: dict[tuple[str, tuple[str, ...]], Any] = {}


def _kernel(family: str, quantities: tuple[str, ...], machine: Machine) -> Any:
    key = (family, quantities)
    if key not in _kernels:

        def point(fixed: Parameters, varied: Parameters) -> tuple[list[Any], Any]:
            response = respond(with_values(machine, {**fixed, **varied}))
            return [QUANTITIES[name].value(response) for name in quantities], response.status

        def slab(fixed: Parameters, varied: Parameters) -> Any:
            blocks = jax.tree.map(lambda column: column.reshape(-1, BLOCK), varied)
            over_block = jax.vmap(point, in_axes=(None, 0))
            found = jax.lax.map(lambda block: over_block(fixed, block), blocks)
            return jax.tree.map(lambda column: column.reshape(-1), found)

        _kernels[key] = jax.jit(slab)
    return _kernels[key]


def run(kernel: Any, fixed: Parameters, varied: Parameters) -> tuple[list[Any], Any]:
    """One slab, waited for, as NumPy arrays."""
    values, status = jax.block_until_ready(kernel(fixed, varied))
    return [np.asarray(value) for value in values], np.asarray(status)
