"""Loaded kernels without their LLVM modules, which only the compiler of another kernel needs: a third of their memory.

Numba keeps a parsed module for each kernel of its cache. Here its bytes stay, and are parsed again when a kernel is
compiled in this process that calls one of the cache.
"""

from __future__ import annotations

from llvmlite.binding import ModuleRef, parse_bitcode
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

OBJECT = "object"  # the kind of cached libraries: machine code, and the module for linking


class LeanLibrary(JITCodeLibrary):
    """Library of one kernel."""

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


def use() -> None:
    """Have Numba make libraries of this kind from here on."""
    JITCPUCodegen._library_class = LeanLibrary
