"""Reads files: text of untrusted sources, raising ValueError with the reason if malformed; and our own data.

Replaces files as a whole.
"""

from __future__ import annotations

import errno
import gzip
import os
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeVar

import msgspec

if TYPE_CHECKING:
    from yaml import SafeLoader

TEXT_MAX = 16 << 20  # characters of a file
PACKAGE = Path(__file__).parent
OF_THE_SHELL = "/dev/fd/", "/dev/stdin", "/proc/self/fd/"
T = TypeVar("T")


@contextmanager
def in_bounds() -> Iterator[None]:
    """Raise ValueError in plain words for no text, for text nested too deeply, or a number of too many digits."""
    try:
        yield
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"not UTF-8 text ({error.reason})") from None
    except ValueError as error:
        if "integer string conversion" in str(error):
            raise ValueError("a number has too many digits") from None
        raise


def open_bytes(path: Path) -> BufferedReader:
    """Open a user's file. Raises OSError, for a named pipe, too: opening that would wait for a program to write."""
    return open(path, "rb", opener=_opened)


def open_text(path: Path, encoding: str = "utf-8", errors: str = "strict") -> TextIO:
    """Open a user's file as ``open_bytes`` does, for its text."""
    return open(path, encoding=encoding, errors=errors, opener=_opened)


def _opened(path: str, flags: int) -> int:
    """Return a descriptor of a regular file, of a folder (which Python refuses), or of what the shell has opened."""
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    mode = os.fstat(descriptor).st_mode
    if os.fspath(path).startswith(OF_THE_SHELL):  # <(command)
        os.set_blocking(descriptor, True)
    elif not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", path)
    return descriptor


def text_of(path: Path, most: int = TEXT_MAX, encoding: str = "utf-8") -> str:
    """Return the text of a file.

    Raises OSError, and ValueError without the file's name if it is not UTF-8 or has more than ``most`` characters.
    """
    with in_bounds(), open_text(path, encoding) as file:
        text = file.read(most + 1)
    if len(text) > most:
        raise ValueError(f"longer than {most} characters")
    return text


def content_of(path: Path) -> bytes:
    """Return the content of a file of the package; a wheel stores some compressed (``wheel_pages``)."""
    packed = path.with_name(f"{path.name}.gz")
    return path.read_bytes() if path.exists() or not packed.exists() else gzip.decompress(packed.read_bytes())


def own_text_of(path: Path, most: int = TEXT_MAX) -> str:
    """Return the text of a file that may be one of the package; raises what ``text_of`` does."""
    ours = path.parent.is_relative_to(PACKAGE)
    return content_of(path).decode() if ours else text_of(path, most)


def tables_in(folder: Path) -> list[Path]:
    """Return the TOML files of a folder, in order; ``own_text_of`` reads those that a wheel stores compressed."""
    return sorted(folder.glob("*.toml")) or sorted(file.with_suffix("") for file in folder.glob("*.toml.gz"))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a place beside ``path`` for a file that replaces it once it is whole; one that is not is deleted.

    Errors of the system that name no file name ``path``.
    """
    place = Path(os.path.realpath(path))  # a link stays one
    fresh = place.with_name(f"{place.name}.new")
    try:
        yield fresh
        fresh.replace(place)
    except BaseException as error:
        fresh.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename = error.filename or str(place)  # a full disk has none
        raise


def bytes_of(path: Path, most: int) -> bytes:
    """Return the bytes of a file. Raises OSError, and ValueError with the file's name beyond ``most`` of them."""
    with open_bytes(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise ValueError(f"{path}: longer than {most} bytes")
    return data


def named_text_of(path: Path, most: int = TEXT_MAX, encoding: str = "utf-8") -> str:
    """Return the text of a file as ``text_of`` does; the errors have the file's name."""
    try:
        return text_of(path, most, encoding)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def parse_toml(text: str) -> dict[str, object]:
    """Return the values of a TOML document. Raises ValueError."""
    with in_bounds():
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"not TOML: {error}") from None


def convert_toml(text: str, kind: type[T], *, strict: bool = True) -> T:
    """Return a TOML document as a value of a type. Raises ValueError, msgspec.ValidationError (which is one)."""
    return msgspec.convert(parse_toml(text), kind, strict=strict, str_keys=True)


def parse_yaml(text: str, loader: type[SafeLoader] | None = None) -> object:
    """Return the values of a YAML document, read by a ``loader`` of plain values. Raises ValueError."""
    import yaml

    with in_bounds():
        try:
            return yaml.load(text, loader or yaml.SafeLoader)
        except yaml.YAMLError as error:
            raise ValueError(str(error)) from None
        except (AttributeError, LookupError, TypeError):  # the library's own, of "!!int ''" or "!!bool maybe"
            raise ValueError("a value does not fit its tag") from None
