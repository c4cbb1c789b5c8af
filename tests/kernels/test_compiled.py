"""Kernels of the cache keep no LLVM modules, and can still be called by one that is compiled later."""

from __future__ import annotations

import errno
import os
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from unittest.mock import Mock

import numba
import numpy as np
import pytest
from numba import njit
from numba.core import caching
from numba.core.registry import cpu_target

from roboglot.kernels import ahead
from roboglot.kernels.ahead import compile_ahead
from roboglot.kernels.arrays import FloatArray
from roboglot.kernels.compiled import CHECKED, StoredLibrary, kernel
from roboglot.kernels.linear import invert
from roboglot.testing.process import child

LOAD_ALL = """
import importlib, sys
from roboglot.kernels import MODULES
for name in MODULES:
    importlib.import_module(f"roboglot.kernels.{name}")
print("numba.np.arrayobj" in sys.modules)
"""


def test_a_cached_kernel_links_into_a_new_one() -> None:
    """``invert`` may have been compiled here, if its cache was empty; made once more, it comes from the cache."""
    cached = kernel("void(float64[:,::1])", error_model=CHECKED)(vars(invert)["__wrapped__"])
    (overload,) = vars(cached)["overloads"].values()
    library = overload.library
    assert isinstance(library, StoredLibrary)
    assert library._shared_module is None

    def twice(matrix: FloatArray) -> None:
        cached(matrix)
        cached(matrix)

    matrix = np.diag([2.0, 4.0, 8.0])
    njit(twice)(matrix)
    assert matrix.tolist() == np.diag([2.0, 4.0, 8.0]).tolist()
    assert library._shared_module is not None


def test_a_cached_kernel_needs_no_declarations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the compiler asks for them: they take 10 MB."""
    refresh = Mock()
    monkeypatch.setattr(cpu_target.target_context, "refresh", refresh)
    cached = kernel("void(float64[:,::1])", error_model=CHECKED)(vars(invert)["__wrapped__"])
    matrix = np.diag([2.0, 4.0, 8.0])
    cached(matrix)
    assert matrix.tolist() == np.diag([0.5, 0.25, 0.125]).tolist()
    refresh.assert_not_called()
    (overload,) = vars(cached)["overloads"].values()
    assert overload.type_annotation == ""  # 20 kB for each kernel


def module_at(source: Path) -> ModuleType:
    spec = spec_from_file_location(source.stem, source)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_kernels_of_a_read_only_folder_are_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write_nothing(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    source = tmp_path / "doubling.py"
    source.write_text("def double(x):\n    return 2 * x\n")
    doubling = module_at(source)
    kernel("int64(int64)")(doubling.double)
    kept = sorted(tmp_path.rglob("*.nb?"))
    assert kept
    monkeypatch.setattr(caching.tempfile, "TemporaryFile", write_nothing)
    monkeypatch.setattr(caching.IndexDataCacheFile, "_open_for_write", write_nothing)
    monkeypatch.setattr(os, "access", lambda *_: False)
    refresh = Mock()
    monkeypatch.setattr(cpu_target.target_context, "refresh", refresh)
    cached = kernel("int64(int64)")(doubling.double)
    refresh.assert_not_called()  # nothing is compiled
    assert cached(21) == 42
    monkeypatch.undo()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert kernel("float64(float64)")(doubling.double)(1.5) == 3.0  # not kept
    assert sorted(tmp_path.rglob("*.nb?")) == kept


def test_a_kernel_compiled_again_elsewhere_is_not_linked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its functions have other names there: the caller's cache would abort every process that loads it."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    source = tmp_path / "doubling.py"
    source.write_text("def double(x):\n    return 2 * x\n")
    doubling = module_at(source)
    kernel("int64(int64)")(doubling.double)
    loaded = kernel("int64(int64)")(doubling.double)
    for kept in tmp_path.rglob("*.nb?"):
        kept.unlink()
    kernel("int64(int64)")(doubling.double)  # as another process does that found none
    with pytest.raises(RuntimeError, match="another process has compiled double again; start once more"):
        njit("int64(int64)")(lambda x: loaded(x) + 1)


def test_kernels_beside_read_only_sources_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """An administrator has installed and compiled; each user would compile once more."""
    compile_ahead()
    beside = Path(ahead.__file__).parent / "__pycache__"
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setattr(caching.tempfile, "TemporaryFile", Mock(side_effect=OSError(errno.EROFS, "Read-only")))
    ahead.cache_folder.cache_clear()
    refresh = Mock()
    monkeypatch.setattr(cpu_target.target_context, "refresh", refresh)
    try:
        assert ahead.cache_folder() == beside
        assert ahead.missing() == []
        cached = kernel("void(float64[:,::1])", error_model=CHECKED)(vars(invert)["__wrapped__"])
        refresh.assert_not_called()
        assert vars(cached)["_cache"].cache_path == str(beside)
        monkeypatch.setattr(ahead, "_machine", lambda: "another processor")
        ahead.cache_folder.cache_clear()
        assert ahead.cache_folder() != beside
    finally:
        ahead.cache_folder.cache_clear()


@pytest.mark.slow
def test_cached_kernels_import_no_lowering_of_arrays() -> None:
    """Each names ``arrayobj`` as the place of its environments; it takes 6 MB."""
    compile_ahead()
    with child(LOAD_ALL) as process:
        assert process.stdout is not None
        assert process.stdout.read() == "False\n"
