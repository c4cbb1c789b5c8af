"""Copies the readable messages of a file without an end into a whole file, byte for byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from roboglot.recording.files import LIBRARY
from roboglot.recording.reader import records


def mend(source: Path, target: Path) -> int:
    """Copy the messages of ``source`` to ``target``; return their number. Raises BadRecording, OSError."""
    count = 0
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    with target.open("xb") as file:
        writer: Any = Writer(file, compression=CompressionType.ZSTD)
        writer.start(library=LIBRARY)
        for record, _, _ in records(source):
            match record:
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
                case Attachment():
                    writer.add_attachment(
                        record.create_time, record.log_time, record.name, record.media_type, record.data
                    )
                case Schema() if record.id not in schemas:
                    schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                case Channel() if record.id not in channels:
                    channels[record.id] = writer.register_channel(
                        record.topic, record.message_encoding, schemas.get(record.schema_id, 0), record.metadata
                    )
                case Message():
                    count += 1
                    writer.add_message(
                        channels[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
                    )
        writer.finish()
    return count
