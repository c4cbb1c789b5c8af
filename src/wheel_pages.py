"""The build step of wheels: stores the console's pages compressed, as ``roboglot/console/assets.py`` reads them.

Loaded by setuptools alone, before the package is there: it imports nothing of it.
"""

from __future__ import annotations

import gzip
from pathlib import Path

from setuptools.command.build_py import build_py  # type: ignore[import-untyped]

PAGES = "roboglot/console/web"
TEXTS = {".html", ".js", ".css", ".json", ".svg"}


class BuildPackage(build_py):  # type: ignore[misc]
    """Copies the package to the build folder; an editable installation keeps the files of the sources."""

    def run(self) -> None:
        """Copy everything, then compress the pages."""
        super().run()
        if not self.editable_mode:
            for path in sorted(Path(self.build_lib, PAGES).rglob("*")):
                if path.suffix in TEXTS:
                    path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
                    path.unlink()
