"""Prints a lock file's pins, with hashes, that count on Linux for a version of Python: image_pins.py LOCK 3.13"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Set
from pathlib import Path

from packaging.markers import Marker, default_environment


def pins(lock: str, python: str) -> str:
    """Return the lines without markers, those that do not count left out."""
    about: dict[str, str | Set[str]] = {
        **{name: str(value) for name, value in default_environment().items()},
        "python_version": python,
        "python_full_version": f"{python}.0",
        "sys_platform": "linux",
        "platform_system": "Linux",
        "os_name": "posix",
        "platform_machine": os.uname()[4],
    }
    kept = []
    for entry in re.split(r"^(?=[A-Za-z0-9])", lock, flags=re.MULTILINE)[1:]:
        head, _, hashes = entry.partition("\\")
        pin, _, marker = head.partition(";")
        if not marker.strip() or Marker(marker.strip()).evaluate(about):
            kept.append(f"{pin.strip()} \\{hashes}")
    return "".join(kept)


if __name__ == "__main__":
    sys.stdout.write(pins(Path(sys.argv[1]).read_text("utf-8"), sys.argv[2]))
