"""Names of the files with keys and certificates, and their writing. Knows no key."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

FOLDER = "cyberdog"  # in the data folder
CA_CERT, SERVER_CERT, SERVER_KEY = "ca-cert.pem", "server-cert.pem", "server-key.pem"


def write(path: Path, data: bytes, *, private: bool = False) -> None:
    """Write a file atomically; if ``private``, it is never readable by others."""
    descriptor, draft = tempfile.mkstemp(dir=path.parent)  # made with mode 0600
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if not private:
            Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except OSError:
        Path(draft).unlink(missing_ok=True)
        raise
