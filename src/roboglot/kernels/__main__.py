"""``python -m roboglot.kernels [NAME ...]``: compile kernels ahead into the cache on disk, on all cores.

With ``--compiler`` it is one of its own processes, which compiles the kernels named on standard input, one a line.
"""

from __future__ import annotations

import gc
import importlib
import sys
import time

from roboglot.kernels import MODULES
from roboglot.kernels.ahead import KernelsUnavailable, compile_ahead


def compiler() -> None:
    """Compile the kernel named on each line, and print its name."""
    gc.disable()  # collection would take a tenth of the time, and this process lives for seconds
    for line in sys.stdin:
        name = line.strip()
        if name not in MODULES:
            sys.exit(f"there is no kernel {name!r}")
        importlib.import_module(f"roboglot.kernels.{name}")
        sys.stdout.write(f"{name}\n")
        sys.stdout.flush()


def main(names: list[str]) -> None:
    """Compile ``names``, or all, and report progress."""
    begun = time.perf_counter()

    def report(name: str, done: int, total: int) -> None:
        sys.stdout.write(f"[{done}/{total}] {name} ready after {time.perf_counter() - begun:.1f} s\n")
        sys.stdout.flush()

    try:
        compile_ahead(names or MODULES, report)
    except KernelsUnavailable as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)


if sys.argv[1:] == ["--compiler"]:
    compiler()
else:
    main(sys.argv[1:])
