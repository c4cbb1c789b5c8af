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
from llvmlite.binding import ModuleRef, parse_bitcode
from numba import njit, types
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.extending import typeof_impl
from numba.np.numpy_support import from_dtype, map_layout

F = TypeVar("F", bound=Callable[..., object])
OBJECT = "object"  # Numba's kind of cached libraries: machine code, and the module for linking
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


class LeanLibrary(JITCodeLibrary):
    """Library of a cached kernel, without its LLVM module, which only the compiler of another kernel needs.

    Numba keeps that parsed: a third of the memory of all. Here its bytes stay, and are parsed again when a kernel is
    compiled in this process that calls this one.
    """

    _shared_module: ModuleRef | None
    _bitcode = b""

    @classmethod
    def _unserialize(cls, codegen: JITCPUCodegen, state: tuple[str, str, tuple[bytes, bytes]]) -> LeanLibrary:
        """Return a library of the cache; called by Numba."""
        library: LeanLibrary = super()._unserialize(codegen, state)
        _, kind, data = state
        if kind == OBJECT:
            library._bitcode = data[1]
            library._shared_module = None
        return library

    def _get_module_for_linking(self) -> ModuleRef:
        """Return the module for a caller that is compiled; called by Numba."""
        if self._shared_module is None and self._bitcode:
            self._shared_module = parse_bitcode(self._bitcode)
        return super()._get_module_for_linking()


JITCPUCodegen._library_class = LeanLibrary
