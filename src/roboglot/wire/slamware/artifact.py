"""Chapter "artifact": points of interest; home docks are written the same way."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.wire.slamware.geometry import Pose2D, Pose3D

ID_MAX = 64
METADATA_MAX = 64  # entries
METADATA_TEXT_MAX = 4096  # characters

Identifier = Annotated[str, msgspec.Meta(min_length=1, max_length=ID_MAX)]
_Text = Annotated[str, msgspec.Meta(max_length=METADATA_TEXT_MAX)]
_Key = Annotated[str, msgspec.Meta(max_length=ID_MAX)]
# Values are text by the manual, but clients send numbers as well, and [] for none.
Metadata = (
    Annotated[dict[_Key, _Text | int | float | bool | None], msgspec.Meta(max_length=METADATA_MAX)]
    | Annotated[list[None], msgspec.Meta(max_length=0)]
    | None
)


class PoseEntry(msgspec.Struct, omit_defaults=True):
    """A pose with a client-made id (a UUID) and free metadata. Without a pose: where the robot is."""

    id: Identifier
    pose: Pose2D | None = None
    metadata: Metadata = None


class PoseChange(msgspec.Struct):
    """New pose, new metadata, or both; what is absent stays."""

    pose: Pose3D | None = None
    metadata: Metadata = None


def metadata_text(metadata: Metadata) -> dict[str, str]:
    """Metadata with every value as text, in the JSON spelling where it was none."""
    if not isinstance(metadata, dict):
        return {}
    return {k: v if isinstance(v, str) else msgspec.json.encode(v).decode() for k, v in metadata.items()}
