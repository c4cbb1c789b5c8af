"""Writes a recording as a ROS 2 bag: a folder with ``metadata.yaml`` and an MCAP or SQLite file."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any, Literal

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

from roboglot.recording.reader import BadRecording, read_messages
from roboglot.recording.ros2.translation import STORE, Ros2Translator, RosMessage

VERSION: Literal[8] = 8  # of metadata.yaml
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
NEVER = QosTime(2147483647, 4294967295)


def export(recording: Path, bag: Path, storage: str = "mcap", robot: str = "") -> Counter[str]:
    """Write the messages of a recording, or of one robot, into the new folder ``bag``; return counts by topic.

    Raises BadRecording, OSError; a new folder is then removed.
    """
    new = not bag.exists()
    try:
        return _write(recording, bag, storage, robot)
    except WriterError as error:  # the folder is there already, say
        raise BadRecording(str(error)) from None
    except (OSError, ValueError) as error:
        if new:
            shutil.rmtree(bag, ignore_errors=True)
        if isinstance(error, OSError | BadRecording):
            raise
        raise BadRecording(f"{recording}: {error}") from None


def _write(recording: Path, bag: Path, storage: str, robot: str) -> Counter[str]:
    words, written = Ros2Translator(robot), Counter[str]()
    with Writer(bag, version=VERSION, storage_plugin=STORAGES[storage]) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for record in read_messages(recording):
            for message in words.translate(record):
                key = message.topic, message.type
                connection = connections.get(key) or _connection(writer, message)
                connections[key] = connection
                writer.write(connection, message.at, message.data)
                written[message.topic] += 1
    return written


def _connection(writer: Writer, message: RosMessage) -> Any:
    qos = Qos(
        QosHistory.KEEP_LAST,
        1 if message.kept else 10,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if message.kept else QosDurability.VOLATILE,
        NEVER,
        NEVER,
        QosLiveliness.AUTOMATIC,
        NEVER,
        avoid_ros_namespace_conventions=False,
    )
    return writer.add_connection(message.topic, message.type, typestore=STORE, offered_qos_profiles=[qos])
