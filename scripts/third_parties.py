"""Writes THIRD_PARTY_LICENSES.md from requirements/run.lock and what is installed; `--check` compares."""

from __future__ import annotations

import re
import sys
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "THIRD_PARTY_LICENSES.md"
WORDS_MAX = 60  # characters of a licence's name; some packages put its whole text there
HEAD = """# Third parties

What `pip install 'roboglot[demo]'` fetches beside roboglot, by `scripts/third_parties.py`. None of it is part of
roboglot's own wheel. PyAV (`av`) and OpenCV bundle FFmpeg, PyAV with x264 and x265 (GPL): docs/reference/licences.md.

| package | version | licence |
|---|---|---|
"""


def licence(package: str) -> str:
    """The licence that the installed package names; an empty text where it is not for this system."""
    try:
        about = metadata(package)
    except PackageNotFoundError:
        return ""
    (named, *_) = about.get_all("License-Expression") or [""]
    classified = [c.rpartition(" :: ")[2] for c in about.get_all("Classifier") or () if c.startswith("License ::")]
    lines = "".join(about.get_all("License") or ()).strip().splitlines()
    return named or ", ".join(classified) or (lines[0][:WORDS_MAX] if lines else "see the package")


def text() -> str:
    """The whole file."""
    pins = re.findall(r"^([A-Za-z0-9._-]+)==(\S+)", (ROOT / "requirements/run.lock").read_text(), re.MULTILINE)
    rows = [(name, version, licence(name)) for name, version in sorted(set(pins))]
    return HEAD + "".join(f"| {name} | {version} | {words} |\n" for name, version, words in rows if words)


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        if FILE.read_text("utf-8") != text():
            sys.exit("THIRD_PARTY_LICENSES.md is older than requirements/run.lock: run scripts/third_parties.py")
    else:
        FILE.write_text(text(), "utf-8")
