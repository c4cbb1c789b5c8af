"""The messages of recordings are those of Foxglove's own SDK, field by field.

The SDK (54 MB) is not a dependency: ``pip install foxglove-sdk`` has this test run.
"""

from __future__ import annotations

import pytest
from google.protobuf import descriptor_pb2

from roboglot.recording import entries, foxglove

sdk = pytest.importorskip("foxglove.messages", reason="no foxglove-sdk here")
Fields = dict[str, set[tuple[object, ...]]]


def fields_of(described: bytes) -> Fields:
    """Return (number, name, type) of the fields of all messages in a FileDescriptorSet, and the values of enums."""
    found: Fields = {}

    def look(place: str, message: descriptor_pb2.DescriptorProto) -> None:
        here = f"{place}.{message.name}"
        found[here] = {(field.number, field.name, field.type, field.label, field.type_name) for field in message.field}
        found.update({f"{here}.{enum.name}": {(v.number, v.name) for v in enum.value} for enum in message.enum_type})
        for nested in message.nested_type:
            look(here, nested)

    for file in descriptor_pb2.FileDescriptorSet.FromString(described).file:
        for message in file.message_type:
            look(file.package, message)
    return found


@pytest.mark.parametrize("name", sorted(foxglove.TYPES))
def test_a_message_has_the_fields_of_the_sdk(name: str) -> None:
    theirs = fields_of(getattr(sdk, name.removeprefix("foxglove.")).get_schema().data)
    ours = fields_of(foxglove.schema(name))
    assert ours
    assert {message: ours[message] for message in theirs.keys() & ours.keys()} == theirs


def test_every_kind_of_message_is_compared() -> None:
    named = {kind.schema for kind in entries.KINDS.values() if kind.schema.startswith("foxglove.")}
    assert named <= set(foxglove.TYPES)
