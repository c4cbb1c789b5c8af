"""Chapter "firmware": versions offered by the maker. Packages have their own file."""

from __future__ import annotations

import msgspec


class FirmwareInfo(msgspec.Struct, omit_defaults=True):
    """A version offered by the maker; empty if there is none."""

    manufacturer: str = ""
    model: str = ""
    firmware: str = ""
    firmware_id: str = ""
