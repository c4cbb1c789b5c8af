"""Checks without a network that requirements/*.lock match pyproject.toml; `--write` marks them as matching.

scripts/lock puts a checksum of what pyproject.toml asks for on top of each lock file; any change there asks for a new
lock. Knows nothing about resolving versions: uv does that.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MARK = "# made by scripts/lock from pyproject.toml, whose requirements have the SHA-256 "


def digest(pyproject: str) -> str:
    """SHA-256 (hex) of everything in pyproject.toml's text that decides about versions."""
    document = tomllib.loads(pyproject)
    project = document["project"]
    asked = [
        project["requires-python"],
        project["dependencies"],
        project["optional-dependencies"],
        document["dependency-groups"],
        document.get("tool", {}).get("uv", {}),
    ]
    return hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()


def pins(lock: str) -> dict[str, frozenset[str]]:
    """A lock file's text as {`name==version ; marker`: its hashes}."""
    entries = re.split(r"^(?=[A-Za-z0-9])", lock, flags=re.MULTILINE)[1:]
    return {
        entry.partition("\\")[0].strip(): frozenset(re.findall(r"--hash=(sha256:[0-9a-f]{64})", entry))
        for entry in entries
    }


def marked(lock: str, checksum: str) -> str:
    """The lock file's text with the mark on top, in place of an older one."""
    body = "".join(line for line in lock.splitlines(keepends=True) if not line.startswith(MARK))
    return f"{MARK}{checksum}\n{body}"


def complaints(root: Path) -> list[str]:
    """Problems of the lock files; an empty list if there are none."""
    found = []
    checksum = digest((root / "pyproject.toml").read_text())
    texts = {name: (root / f"requirements/{name}.lock").read_text() for name in ("run", "dev")}
    for name, text in texts.items():
        if text.partition("\n")[0] != MARK + checksum:
            found.append(f"requirements/{name}.lock is older than pyproject.toml's requirements: run scripts/lock")
        found += [f"requirements/{name}.lock: {pin} has no hash" for pin, hashes in pins(text).items() if not hashes]
    dev = pins(texts["dev"])
    for pin, hashes in pins(texts["run"]).items():
        everywhere = pin.partition(" ;")[0]  # a tool may need it on systems that roboglot does not support
        if hashes not in (dev.get(pin), dev.get(everywhere)):
            found.append(f"requirements/dev.lock doesn't hold {pin} of run.lock: run scripts/lock")
    return found


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        for file in (ROOT / "requirements/run.lock", ROOT / "requirements/dev.lock"):
            file.write_text(marked(file.read_text(), digest((ROOT / "pyproject.toml").read_text())))
    sys.exit("\n".join(complaints(ROOT)) or 0)
