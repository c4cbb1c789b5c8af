"""A port that cannot be opened is named in the same words under each event loop."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Coroutine

import pytest
import uvloop

from roboglot.transport.listening import listen


@pytest.mark.parametrize("run", [asyncio.run, uvloop.run])
def test_port_in_use_is_named(run: Callable[[Coroutine[object, object, object]], object]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match="in use") as refused:
            run(listen(asyncio.Protocol, "127.0.0.1", port))
    assert refused.value.strerror == f"127.0.0.1:{port} is in use by another program"


def test_address_of_another_machine_is_named() -> None:
    with pytest.raises(OSError, match=r"cannot listen on 192\.0\.2\.77:0: it is not an address of this machine"):
        asyncio.run(listen(asyncio.Protocol, "192.0.2.77", 0))
    with pytest.raises(OSError, match=r"cannot listen on \[2001:db8::77\]:0: it is not an address of this machine"):
        asyncio.run(listen(asyncio.Protocol, "2001:db8::77", 0))
