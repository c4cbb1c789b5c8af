"""Bytecode of all modules that a program has loaded, in one file: half of a start was the search for a thousand files.

It does what Python does with the files in ``__pycache__``, of which it is made: a module whose source has another time
or size is loaded as ever. Only modules inside of packages are in it; which package is found first on ``sys.path`` stays
Python's business. Imports hardly anything, because each command reads it first.
"""

from __future__ import annotations

import contextlib
import marshal
import mmap
import os
import sys
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
NAME = f"roboglot.{sys.implementation.cache_tag}-{sys.flags.optimize}.bytecode"
LENGTH = 8  # bytes before the index: its length
HEADER = 16  # bytes of a file in __pycache__ before the code: magic number, flags, time and size of the source
Entry = tuple[str, bool, int, int, int, int]  # source, is it a package, time (ns) and size of it; where the code is


class Kept(SourceFileLoader):
    """Loader of one module whose bytecode was kept."""

    code: memoryview

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the module's code; called by Python."""
        code: CodeType = marshal.loads(self.code)
        return code


class Bytecode:
    """Finder of modules whose bytecode is in the file, for ``sys.meta_path``."""

    def __init__(self, file: str) -> None:
        """Read the index. Raises OSError, ValueError, EOFError if there is none."""
        with open(file, "rb") as opened:
            self._mapped = mmap.mmap(opened.fileno(), 0, prot=mmap.PROT_READ)
        data = memoryview(self._mapped)
        begin = LENGTH + int.from_bytes(data[:LENGTH], "little")
        self.index: dict[str, Entry] = marshal.loads(data[LENGTH:begin])
        self._code = data[begin:]

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of a module whose source is as it was, else None; called by Python."""
        if path is None or (entry := self.index.get(name)) is None:
            return None
        source, is_package, changed, size, *_ = entry
        folder = os.path.dirname(source)
        if (os.path.dirname(folder) if is_package else folder) not in path:
            return None
        try:
            found = os.stat(source)
        except OSError:
            return None
        if (found.st_mtime_ns, found.st_size) != (changed, size):
            return None
        loader = Kept(name, source)
        loader.code = self.code_of(entry)
        spec = ModuleSpec(name, loader, origin=source, is_package=is_package)
        spec.has_location = True
        if is_package:
            spec.submodule_search_locations = [folder]
        return spec

    def code_of(self, entry: Entry) -> memoryview:
        """Return the bytecode of a module."""
        return self._code[entry[4] : entry[4] + entry[5]]

    def rest(self) -> None:
        """Return the file's pages to the system; those that are needed again are read again."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self._mapped.madvise(mmap.MADV_DONTNEED)


def use() -> None:
    """Load modules from the file from now on, if there is one."""
    for folder in _folders():
        with contextlib.suppress(OSError, ValueError, EOFError, TypeError):
            finder = Bytecode(os.path.join(folder, NAME))
            sys.meta_path.insert(sys.meta_path.index(PathFinder) if PathFinder in sys.meta_path else 0, finder)
            return


def keep() -> None:
    """Write the file anew if this process has loaded modules that are not in it, and return its pages to the system.

    Does nothing where there is no place for it, or if Python shall write no bytecode.
    """
    used = next((finder for finder in sys.meta_path if isinstance(finder, Bytecode)), None)
    if not sys.dont_write_bytecode and (loaded := dict(_loaded())):
        entries, codes = _collected(loaded, used)
        for folder in _folders():
            with contextlib.suppress(OSError):
                os.makedirs(folder, mode=0o700, exist_ok=True)
                _write(os.path.join(folder, NAME), marshal.dumps(entries), codes)
                break
    if used is not None:
        used.rest()


def _folders() -> Iterator[str]:
    """Yield the folder beside the sources if we may write there, else the user's and then that one."""
    beside = os.path.join(PACKAGE, "__pycache__")
    if not os.access(beside, os.W_OK):
        cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
        yield os.path.join(cache, "roboglot")
    yield beside


def _loaded() -> Iterator[tuple[str, ModuleSpec]]:
    """Yield names and specs of this process's modules that could be in the file and are not."""
    for name, module in list(sys.modules.items()):
        spec = getattr(module, "__spec__", None)
        if "." in name and spec is not None and type(spec.loader) is SourceFileLoader and spec.name == name:
            yield name, spec


def _collected(loaded: dict[str, ModuleSpec], used: Bytecode | None) -> tuple[dict[str, Entry], list[bytes]]:
    """Return the index and the bytecode of modules loaded now, and of those in the file whose source is as it was."""
    entries: dict[str, Entry] = {}
    codes: list[bytes] = []
    at = 0

    def add(name: str, entry: Entry, code: bytes) -> None:
        nonlocal at
        entries[name] = (*entry[:4], at, len(code))
        codes.append(code)
        at += len(code)

    for name, entry in used.index.items() if used else ():
        with contextlib.suppress(OSError):
            found = os.stat(entry[0])
            if name not in loaded and (found.st_mtime_ns, found.st_size) == entry[2:4]:
                assert used is not None
                add(name, entry, bytes(used.code_of(entry)))
    for name, spec in loaded.items():
        if (made := _made(spec)) is not None:
            add(name, *made)
    return entries, codes


def _made(spec: ModuleSpec) -> tuple[Entry, bytes] | None:
    """Return a module's bytecode as Python has kept it, if it is that of the present source."""
    if spec.origin is None or spec.cached is None:
        return None
    with contextlib.suppress(OSError):
        found = os.stat(spec.origin)
        with open(spec.cached, "rb") as file:
            data = file.read()
        time, size = (int.from_bytes(data[at : at + 4], "little") for at in (8, 12))
        if not any(data[4:8]) and (time, size) == (int(found.st_mtime) & 0xFFFFFFFF, found.st_size & 0xFFFFFFFF):
            is_package = spec.submodule_search_locations is not None
            return (spec.origin, is_package, found.st_mtime_ns, found.st_size, 0, 0), data[HEADER:]
    return None


def _write(file: str, index: bytes, codes: list[bytes]) -> None:
    """Replace the file as a whole. Raises OSError."""
    made = f"{file}.{os.getpid()}"
    try:
        with open(made, "xb") as opened:
            opened.write(len(index).to_bytes(LENGTH, "little") + index)
            opened.writelines(codes)
        os.replace(made, file)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(made)
        raise
