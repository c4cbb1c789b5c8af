"""Upload of large bodies to disk: a package is never whole in memory. Knows no HTTP words."""

from __future__ import annotations

import hashlib
import tempfile
from typing import BinaryIO, cast

PACKAGE_MAX = 500 * 1000**2  # bytes of a firmware or app package


class Upload:
    """A body in an unnamed temporary file, deleted once closed. A handler takes it as its ``body``."""

    def __init__(self) -> None:
        self.file: BinaryIO = cast(BinaryIO, tempfile.TemporaryFile(prefix="roboglot-"))  # noqa: SIM115 # closed by ``close``
        self.size = 0
        self._digest = hashlib.md5(usedforsecurity=False)

    def write(self, chunk: bytes) -> None:
        """Append a chunk."""
        self.file.write(chunk)
        self._digest.update(chunk)
        self.size += len(chunk)

    @property
    def digest(self) -> str:
        """MD5 of the received data, in hex: the name of a package."""
        return self._digest.hexdigest()

    def close(self) -> None:
        """Delete the file."""
        self.file.close()
