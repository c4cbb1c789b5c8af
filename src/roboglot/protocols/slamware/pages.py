"""Pages besides the API: its description, and a page to try the operations, without external resources."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import msgspec

from roboglot.protocols.slamware.openapi import document
from roboglot.text_files import content_of

FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/index.html": ("index.html", "text/html; charset=utf-8"),
    "/page/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/page/page.css": ("page.css", "text/css; charset=utf-8"),
}
DESCRIPTION = "/openapi.json"


class Pages:
    """Files by path; the description is made at the first request."""

    def find(self, path: str) -> tuple[str, bytes] | None:
        """Return content type and content of ``path``, or None."""
        if path == DESCRIPTION:
            return "application/json", self._description
        if path not in FILES:
            return None
        name, content_type = FILES[path]
        return content_type, content_of(Path(__file__).with_name("page") / name)

    @cached_property
    def _description(self) -> bytes:
        return msgspec.json.encode(document())
