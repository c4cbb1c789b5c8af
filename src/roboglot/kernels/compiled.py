"""Compilation of kernels: ahead of time for one signature, cached on disk, without the interpreter's lock.

No C wrapper is made, which nothing calls and which takes a tenth of the compiler's time. Kernels are written with loops
rather than array expressions, reductions, ``np.full`` or ``np.round``: those compile ten times as slowly, and run no
faster. Divisions are not checked: a check costs a branch, and a loop with one is not turned into vectors. So a kernel
divides only by what cannot be 0, or asks for CHECKED.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numba import njit, types
from numba.extending import typeof_impl
from numba.np.numpy_support import from_dtype, map_layout

from roboglot.kernels import lean

lean.use()
F = TypeVar("F", bound=Callable[..., object])
CHECKED = "python"  # error model of kernels that raise ZeroDivisionError


def kernel(signature: str | None = None, **options: object) -> Callable[[F], F]:
    """Compile a function for this signature (None: for the types of its calls); ``options`` are Numba's."""
    chosen = {"error_model": "numpy"} | options
    compiled: Callable[[F], F] = njit(signature, cache=True, nogil=True, no_cfunc_wrapper=True, **chosen)
    return compiled


@typeof_impl.register(np.ndarray)
def _typeof_array(array: np.ndarray[tuple[int, ...], np.dtype[np.generic]], _context: object) -> types.Array:
    """Return an array's type as Numba does, except for masked arrays: the check for those takes 30 ms and 1.2 MB."""
    dtype = from_dtype(cast("np.dtype[np.bool]", array.dtype))  # of any kind: Numba's annotation is narrower than it is
    return types.Array(dtype, array.ndim, map_layout(array), readonly=not array.flags.writeable)
