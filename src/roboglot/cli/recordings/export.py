"""``roboglot export``: converts a recording to a format of other tools."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible


class Storage(StrEnum):
    """Storage format of a bag of ROS 2."""

    MCAP = "mcap"
    SQLITE = "sqlite3"


def command(
    file: Annotated[Path, typer.Argument(help="A recording.")],
    rosbag2: Annotated[Path, typer.Option(metavar="FOLDER", help="Write a bag of ROS 2 into this new folder.")],
    storage: Annotated[Storage, typer.Option(help="mcap for ROS 2 Iron and newer, sqlite3 for older.")] = Storage.MCAP,
    robot: Annotated[str, typer.Option(help="Only this robot's topics.")] = "",
) -> None:
    """Write a recording as a bag of ROS 2."""
    from roboglot.recording.ros2.bag import export

    try:
        written = export(file, rosbag2, storage.value, robot)
    except (OSError, ValueError) as error:
        print(f"roboglot export: {visible(in_words(error))}", file=sys.stderr)
        raise typer.Exit(2) from None
    for topic, count in sorted(written.items()):
        print(f"{count:8} {visible(topic)}")
    print(f"{written.total():8} messages in {rosbag2}")
