"""Log lines: one an event, on standard error, with the robot that it is about."""

from __future__ import annotations

import logging

from roboglot.hosting.visible import VisibleFormatter
from roboglot.model.client_context import concerned

NOISY = ("uvicorn", "websockets", "httpx", "grpc", "asyncio", "numba")


class NamesRobot(logging.Filter):
    """Puts the robot's name before a line about one that does not name it."""

    def filter(self, record: logging.LogRecord) -> bool:
        if (robot := concerned()) and (name := f"robot {robot}") not in (text := record.getMessage()):
            record.msg, record.args = f"{name}: {text}", None
        return True


def set_up_logging(verbose: bool) -> None:
    """One readable line per event, on standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(VisibleFormatter("%(asctime)s %(levelname)-7s %(message)s  (%(name)s)", "%H:%M:%S"))
    handler.addFilter(NamesRobot())
    logging.basicConfig(level=logging.DEBUG if verbose else logging.INFO, handlers=[handler])
    for name in NOISY:
        logging.getLogger(name).setLevel(logging.INFO if verbose else logging.WARNING)
