"""Compilation of kernels: ahead of time for one signature, cached on disk, without the interpreter's lock.

No C wrapper is made, which nothing calls and which takes a tenth of the compiler's time. Kernels are written with loops
rather than array expressions, reductions, ``np.full`` or ``np.round``: those compile ten times as slowly, and run no
faster. Divisions are not checked: a check costs a branch, and a loop with one is not turned into vectors. So a kernel
divides only by what cannot be 0, or asks for CHECKED.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar, cast

import numpy as np
from llvmlite.binding import ModuleRef, ObjectFileRef, parse_bitcode
from numba import njit, types
from numba.core import dispatcher, environment
from numba.core.caching import CacheImpl, FunctionCache, InTreeCacheLocator, UserProvidedCacheLocator
from numba.core.codegen import CodeLibrary, JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompileResult
from numba.core.cpu import CPUContext
from numba.core.runtime import rtsys
from numba.core.typing import Signature
from numba.extending import typeof_impl
from numba.np.numpy_support import from_dtype, map_layout

from roboglot.kernels import ahead  # part of no kernel: a change of it recompiles none

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


class StoredLibrary(JITCodeLibrary):
    """Library of a kernel from the cache: machine code, linked as it is.

    Numba makes an LLVM module for it, parses the one that another kernel's compiler would need, and lists the symbols
    of both: that takes three times as long, and a third of the memory of all. Here that module is read when a kernel
    is compiled in this process that calls this one. No kernel calls itself, which would need Numba's own linker.
    """

    _shared_module: ModuleRef | None

    def __init__(self, codegen: JITCPUCodegen, name: str, code: bytes) -> None:
        CodeLibrary.__init__(self, codegen, name)  # the classes between make a module
        self._finalized = self._disable_inspection = True
        self._shared_module = None
        self._reload_init: set[object] = set()  # set by a class between, before Numba 0.68
        self.stored: Callable[[], tuple[bytes, bytes]] | None = None  # returns machine code and module
        self._code = hash(code)
        codegen._engine._ee.add_object_file(ObjectFileRef.from_data(code))

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of one of the kernel's functions; called by Numba."""
        return cast("int", self._codegen._engine.get_function_address(name))

    def _get_module_for_linking(self) -> ModuleRef:
        """Return the module for a caller that is compiled; called by Numba. Raises RuntimeError.

        Each compilation gives its functions other names. A caller that was linked with another one's module would end
        every process that loads it: LLVM aborts if a name is not found.
        """
        if self._shared_module is None:
            assert self.stored is not None
            code, module = self.stored()
            if hash(code) != self._code:
                raise RuntimeError(f"another process has compiled {self.name} again; start once more")
            self._shared_module = parse_bitcode(module)
        return self._shared_module


class LeanLibrary(JITCodeLibrary):
    """Library of a kernel that is compiled in this process; those of the cache become a ``StoredLibrary``."""

    @classmethod
    def _unserialize(cls, codegen: JITCPUCodegen, state: tuple[str, str, tuple[bytes, bytes]]) -> StoredLibrary:
        """Return a library of the cache; called by Numba."""
        name, _, (code, _) = state  # the cache has machine code of all
        return StoredLibrary(codegen, name, code)


class ReadableFolder(UserProvidedCacheLocator):
    """Locates kernels in ``NUMBA_CACHE_DIR`` even if it is read-only; Numba would compile anew."""

    def ensure_cache_path(self) -> None:
        """Raise OSError if the folder is not there and cannot be made; called by Numba."""
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)


class BesideSources(InTreeCacheLocator):
    """Locates kernels beside their sources where ``ahead`` finds them, even if they cannot be written there."""

    def ensure_cache_path(self) -> None:
        """Raise OSError if they are elsewhere; called by Numba."""
        if Path(self.get_cache_path()) != ahead.cache_folder():
            raise FileNotFoundError(self.get_cache_path())


class LeanCache(FunctionCache):
    """Cache of a kernel that is loaded without Numba's declarations, which only the compiler needs.

    They are 10 MB and take 0.1 s; the compiler makes sure itself that they are there.
    """

    def load_overload(self, signature: Signature, context: CPUContext) -> CompileResult | None:
        """Return what the cache has for a signature; called by Numba."""
        rtsys.initialize(context)  # arrays are counted by it
        with self._guard_against_spurious_io_errors():
            found: CompileResult | None = self._load_overload(signature, context)
        if found is not None:
            found = found._replace(type_annotation="")  # 3 MB of all
            found.library.stored = partial(self._stored, self._index_key(signature, context.codegen()))
        return found

    def save_overload(self, signature: Signature, data: CompileResult) -> None:
        """Keep a compiled function, if the folder can be written; called by Numba."""
        if os.access(self.cache_path, os.W_OK):
            super().save_overload(signature, data)

    def _stored(self, key: object) -> tuple[bytes, bytes]:
        """Return a library's machine code and module. Raises RuntimeError if another process has emptied the cache."""
        if (found := self._cache_file.load(key)) is None:
            raise RuntimeError(f"{self._cache_file} is empty")
        return cast("tuple[bytes, bytes]", found[0][2])  # after name and kind


def _rebuild_env(module: str, constants: list[object], name: str) -> environment.Environment:
    """Return a function's environment without importing its module (``arrayobj``: 6 MB)."""
    found = environment.lookup_environment(name)
    if found is None:
        found = environment.Environment(vars(sys.modules[module]) if module in sys.modules else {"__name__": module})
        found.consts[:], found.env_name = constants, name
        environment.Environment._memo[name] = found
    return found


_rebuild_env.__module__ = environment.__name__  # pickles name Numba's
vars(environment)["_rebuild_env"] = _rebuild_env
JITCPUCodegen._library_class = LeanLibrary
vars(dispatcher)["FunctionCache"] = LeanCache
CacheImpl._locator_classes[:0] = [ReadableFolder, BesideSources]
