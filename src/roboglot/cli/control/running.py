"""Requests of commands to a running `roboglot up` or fleet, over the socket in its data folder."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Protocol, TypeVar

import msgspec

from roboglot.hosting.error_text import in_words
from roboglot.hosting.local_socket import ask


class HasError(Protocol):
    """Answer with the reason of a refusal, or an empty one."""

    error: str


A = TypeVar("A", bound=HasError)


def request(
    command: str,
    path: Path,
    request: msgspec.Struct,
    kind: type[A],
    patience: float,
    absent: str = "",
) -> A:
    """Return the answer from the socket ``path`` within ``patience`` s.

    Without one, or if it is a refusal, end the program with a sentence that names ``command``; ``absent`` is that if
    no program has the socket.
    """
    try:
        answer = asyncio.run(exchange(path, request, kind, patience))
    except (FileNotFoundError, ConnectionRefusedError):
        sys.exit(f"roboglot {command}: {absent or f'no `roboglot up` answers in {path.parent}'}")
    except TimeoutError:
        sys.exit(f"roboglot {command}: no answer from {path.parent} in {patience:g} s; it may still be carried out")
    except OSError as error:
        sys.exit(f"roboglot {command}: no answer from {path.parent}: {in_words(error)}")
    except msgspec.DecodeError:
        sys.exit(f"roboglot {command}: the program in {path.parent} is of another version")
    if answer.error:
        sys.exit(f"roboglot {command}: {answer.error}")
    return answer


async def exchange(path: Path, request: msgspec.Struct, kind: type[A], patience: float) -> A:
    """Return the answer. Raises OSError (TimeoutError after ``patience`` s), DecodeError if it is of another kind."""
    return msgspec.json.decode(await ask(path, msgspec.json.encode(request), patience), type=kind)
