"""Errors in HTTP: the table from RobotError to a status, and the manual's texts for bad requests.

The vendor's robots put the text into the reason phrase; we send it there and as a text/plain body.
"""

from __future__ import annotations

from roboglot.model.errors import (
    Blocked,
    Busy,
    ComponentMissing,
    DockNotFound,
    Expired,
    InvalidGoal,
    NotFound,
    NotReady,
    Refused,
    RobotError,
    Unreachable,
)
from roboglot.values import dataclass

REASON = b"reason-phrase"  # internal header from the dispatch to the connection; never sent
REASON_MAX = 160  # characters of a reason phrase


@dataclass(eq=False)  # not frozen: contextlib writes the traceback into exceptions that pass through
class HttpError(Exception):
    """Error with a status, the text of the reason phrase, a detail for the body, and further headers."""

    status: int
    text: str
    detail: str = ""
    headers: tuple[tuple[bytes, bytes], ...] = ()

    @property
    def body(self) -> str:
        """The text and the detail."""
        return f"{self.text}: {self.detail}" if self.detail else self.text


# First match wins.
STATUSES: dict[type[RobotError], tuple[int, str]] = {
    ComponentMissing: (501, "Not Implemented"),
    InvalidGoal: (400, "Bad Request"),
    NotFound: (404, "Not Found"),
    DockNotFound: (404, "Home dock not found"),
    Busy: (403, "operation fail"),
    NotReady: (503, "Service Unavailable"),
    Refused: (403, "operation fail"),
    Blocked: (403, "operation fail"),
    Expired: (504, "Gateway Timeout"),
    Unreachable: (400, "Bad Request"),
    RobotError: (500, "Internal Server Error"),
}

# The manual's reasons for 400, by operation; all others are "Bad Request".
BAD_REQUESTS = {
    "DELETE /api/core/system/v1/robot/health/{error_code}": "Invalid Error Code",
    "GET /api/core/system/v1/parameter": "Parameter is required",
    "GET /api/delivery/v1/cargos/{cargo_id}/boxes/{box_id}": "Invalid BoxId",
    "GET /api/multi-floor/map/v1/pois": "Invalid floor or building",
    "POST /api/core/motion/v1/actions": "Can not create action",
    "POST /api/core/system/v1/aeb/control": "Invalid JSON data",
    "POST /api/core/system/v1/jack/status": "Invalid JSON data",
    "POST /api/core/system/v1/light/control": "Invalid JSON data",
    "PUT /api/core/slam/v1/localization/pose": "Invalid Argument",
    "PUT /api/core/system/v1/network/route": "Invalid JSON data",
    "PUT /api/delivery/v1/cargos/{cargo_id}/boxes/{box_id}/{op}": "Invalid Operation",
}


def from_robot(error: RobotError, key: str = "") -> HttpError:
    """Translate an error of the model, for the operation ``key``."""
    status, text = next(entry for kind, entry in STATUSES.items() if isinstance(error, kind))
    return bad_request(key, str(error)) if status == 400 else HttpError(status, text, str(error))


def bad_request(key: str, detail: str) -> HttpError:
    """Return the error 400 of the operation ``key``."""
    return HttpError(400, BAD_REQUESTS.get(key, "Bad Request"), detail)


def reason_phrase(text: str) -> bytes:
    """Return ``text`` in the form of a reason phrase: printable ASCII, bounded."""
    return "".join(c if " " <= c <= "~" else "?" for c in text[:REASON_MAX]).encode("ascii")
