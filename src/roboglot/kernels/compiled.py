"""How every kernel is compiled: ahead for its one signature, kept on disk, without the interpreter's lock.

No C wrapper is made, which nothing calls and which takes a tenth of the compiler's time. Kernels are written with loops
rather than array expressions, reductions, ``np.full`` or ``np.round``: those compile ten times as slowly, and run no
faster.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba import njit

kernel: Any = partial(njit, cache=True, nogil=True, no_cfunc_wrapper=True)
