"""Network device that loses and delays the packets of real connections; the kernel's TCP copes at both ends.

The address ``far`` leads back to this machine through the device (tun), which hands every packet to a thread; that
drops it, or returns it later with both addresses exchanged. It needs no second network, only the right to create a
device (Linux, CAP_NET_ADMIN).
"""

from __future__ import annotations

import fcntl
import heapq
import os
import random
import select
import socket
import struct
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import Self

DEVICE = "/dev/net/tun"
PACKET_MAX = 2048  # bytes
UNDERWAY_MAX = 10_000  # packets; further ones are dropped
IPV4 = 4
PREFIX = "198.18"  # RFC 2544: for benchmarks
_MAKE, _ADDRESS, _MASK, _FLAGS = 0x400454CA, 0x8916, 0x891C, 0x8914  # TUNSETIFF, SIOCSIFADDR, -NETMASK, -FLAGS
_PLAIN_TUN = 0x1001  # IFF_TUN, IFF_NO_PI
_UP = 0x41  # IFF_UP, IFF_RUNNING


class LossyDevice:
    """Listen at ``near``, connect to ``far``. ``delay``: s, one way; ``loss``: probability per packet, 0 to 1.

    ``cut``: drop every packet; neither end gets an error. Raises OSError if no device can be created.
    """

    def __init__(self, *, delay: float = 0.05, loss: float = 0.05, seed: int = 1) -> None:
        self.delay, self.loss, self.cut = delay, loss, False
        self.passed = self.lost = 0
        self._chance = random.Random(seed)
        self._tun = os.open(DEVICE, os.O_RDWR | os.O_NONBLOCK)
        try:
            self.near, self.far = _set_up(self._tun)
        except OSError:
            os.close(self._tun)
            raise
        self._over = False
        self._thread = threading.Thread(target=self._carry, name="lossy device", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._over = True
        self._thread.join()
        os.close(self._tun)  # the device disappears with it

    def _carry(self) -> None:
        underway: list[tuple[float, int, bytes]] = []
        poll = select.poll()
        poll.register(self._tun, select.POLLIN)
        while not self._over:
            wait = max(0.0, underway[0][0] - time.perf_counter()) if underway else 0.1
            if poll.poll(1000 * min(wait, 0.1)):
                self._take(underway)
            now = time.perf_counter()
            while underway and underway[0][0] <= now:
                with suppress(OSError):
                    os.write(self._tun, heapq.heappop(underway)[-1])

    def _take(self, underway: list[tuple[float, int, bytes]]) -> None:
        with suppress(BlockingIOError):
            while True:
                packet = os.read(self._tun, PACKET_MAX)
                if packet[0] >> 4 != IPV4:
                    continue
                if self.cut or len(underway) >= UNDERWAY_MAX or self._chance.random() < self.loss:
                    self.lost += 1
                    continue
                self.passed += 1
                turned = packet[:12] + packet[16:20] + packet[12:16] + packet[20:]  # keeps the checksums valid
                heapq.heappush(underway, (time.perf_counter() + self.delay, self.passed, turned))


def _set_up(tun: int) -> tuple[str, str]:
    """Configure the device; return its own address and the one behind it."""
    name = fcntl.ioctl(tun, _MAKE, struct.pack("16sH22x", b"", _PLAIN_TUN))[:16].rstrip(b"\0")
    number = int(name.removeprefix(b"tun")) % 256
    near, far = f"{PREFIX}.{number}.1", f"{PREFIX}.{number}.2"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        for request, address in ((_ADDRESS, near), (_MASK, "255.255.255.0")):
            fcntl.ioctl(control, request, struct.pack("16sHH4s8x", name, socket.AF_INET, 0, socket.inet_aton(address)))
        fcntl.ioctl(control, _FLAGS, struct.pack("16sH14x", name, _UP))
    return near, far
