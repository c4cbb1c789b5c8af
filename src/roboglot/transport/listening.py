"""Opens TCP ports."""

from __future__ import annotations

import asyncio
import errno
import os
from collections.abc import Callable


async def listen(
    factory: Callable[[], asyncio.Protocol], address: str, port: int, backlog: int = 100
) -> asyncio.Server:
    """Listen at a port. Raises OSError whose ``strerror`` names it, in the same words under each Python and loop."""
    try:
        return await asyncio.get_running_loop().create_server(factory, address, port, backlog=backlog)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            reason = f"{address}:{port} is in use by another program"
        else:
            why = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror or str(error)
            reason = f"cannot listen on {address}:{port}: {why}"
        raise OSError(error.errno, reason) from None
