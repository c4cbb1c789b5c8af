"""Kernels of the cache keep no LLVM modules, and can still be called by one that is compiled later."""

from __future__ import annotations

import numpy as np
from numba import njit

from roboglot.kernels.arrays import FloatArray
from roboglot.kernels.compiled import LeanLibrary
from roboglot.kernels.linear import invert


def test_a_cached_kernel_links_into_a_new_one() -> None:
    (overload,) = vars(invert)["overloads"].values()
    library = overload.library
    assert isinstance(library, LeanLibrary)
    assert library._shared_module is None

    def twice(matrix: FloatArray) -> None:
        invert(matrix)
        invert(matrix)

    matrix = np.diag([2.0, 4.0, 8.0])
    njit(twice)(matrix)
    assert matrix.tolist() == np.diag([2.0, 4.0, 8.0]).tolist()
    assert library._shared_module is not None
