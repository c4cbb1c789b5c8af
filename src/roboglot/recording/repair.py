"""Copies the readable messages of a file without an end into a whole file, byte for byte."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Message, Metadata
from mcap.writer import CompressionType, Writer

from roboglot.recording.files import LIBRARY
from roboglot.recording.reader import records


def mend(source: Path, target: Path) -> int:
    """Copy the messages of ``source`` to ``target``; return their number. Raises BadRecording, OSError."""
    count = 0
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    with target.open("xb") as file:
        os.fchmod(file.fileno(), 0o600)
        writer: Any = Writer(file, compression=CompressionType.ZSTD)
        writer.start(library=LIBRARY)
        for record, channel, schema in records(source):
            match record:
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
                case Attachment():
                    writer.add_attachment(
                        record.create_time, record.log_time, record.name, record.media_type, record.data
                    )
                case Message() if channel is not None:
                    if schema is not None and schema.id not in schemas:
                        schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                    if channel.id not in channels:
                        channels[channel.id] = writer.register_channel(
                            channel.topic, channel.message_encoding, schemas.get(channel.schema_id, 0), channel.metadata
                        )
                    count += 1
                    writer.add_message(
                        channels[channel.id], record.log_time, record.data, record.publish_time, record.sequence
                    )
        writer.finish()
    return count
