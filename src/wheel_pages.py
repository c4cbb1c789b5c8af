"""The build step of wheels: stores texts of the package compressed, as ``roboglot.text_files.content_of`` reads them.

Loaded by setuptools alone, before the package is there: it imports nothing of it.
"""

from __future__ import annotations

import gzip
from pathlib import Path

from setuptools.command.build_py import build_py  # type: ignore[import-untyped]

FOLDERS = (
    "roboglot/cli/recordings",
    "roboglot/console/studio",
    "roboglot/console/web",
    "roboglot/protocols/slamware/page",
    "roboglot/simulation",
    "roboglot/storage/schema",
    "roboglot/wire/contracts",
)
TEXTS = {".html", ".js", ".css", ".json", ".sql", ".svg", ".toml"}


class BuildPackage(build_py):  # type: ignore[misc]
    """Copies the package to the build folder; an editable installation keeps the files of the sources."""

    def run(self) -> None:
        """Copy everything, then compress the texts in FOLDERS."""
        super().run()
        if self.editable_mode:
            return
        texts = [path for folder in FOLDERS for path in Path(self.build_lib, folder).rglob("*") if path.suffix in TEXTS]
        for path in texts:
            path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))
            path.unlink()
