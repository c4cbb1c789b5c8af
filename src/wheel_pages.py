"""The build step of wheels: stores the console's texts compressed, as ``roboglot/console/assets.py`` reads them.

Loaded by setuptools alone, before the package is there: it imports nothing of it.
"""

from __future__ import annotations

import gzip
from pathlib import Path

from setuptools.command.build_py import build_py  # type: ignore[import-untyped]

PAGES = "roboglot/console/web"
LABELS = "roboglot/console/studio/labels.toml"
TEXTS = {".html", ".js", ".css", ".json", ".svg"}


class BuildPackage(build_py):  # type: ignore[misc]
    """Copies the package to the build folder; an editable installation keeps the files of the sources."""

    def run(self) -> None:
        """Copy everything, then compress the pages and the labels of the studio's blocks."""
        super().run()
        if self.editable_mode:
            return
        pages = [path for path in Path(self.build_lib, PAGES).rglob("*") if path.suffix in TEXTS]
        for path in (*pages, Path(self.build_lib, LABELS)):
            path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
            path.unlink()
