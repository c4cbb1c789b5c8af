"""``python -m roboglot.kernels``: compile all kernels ahead into the cache on disk."""

from __future__ import annotations

import sys
import time

from roboglot.kernels import MODULES
from roboglot.kernels.ahead import load


def main() -> None:
    """Compile and say how far it is."""
    begun = time.perf_counter()
    for number, name in enumerate(load(), start=1):
        sys.stdout.write(f"[{number}/{len(MODULES)}] {name} ready after {time.perf_counter() - begun:.1f} s\n")
        sys.stdout.flush()


main()
