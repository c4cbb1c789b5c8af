"""Contents of recordings: they come back byte for byte, except what must not be disclosed."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.tap import Direction, Exchange
from roboglot.recording.messages import decode_exchange, encode_exchange, encode_plain
from roboglot.recording.redaction import FIELDS, Redaction

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
PAYLOADS = (
    st.binary(max_size=200)
    | st.text(max_size=200).map(str.encode)
    | VALUES.map(lambda value: json.dumps(value).encode())
    | VALUES.map(lambda value: b"POST /api/x\n\n" + json.dumps(value, indent=1).encode())
)


def exchange(payload: bytes) -> Exchange:
    return Exchange(
        1.5, "a", "slamware", "127.0.0.1:5", "slamware 127.0.0.1", Direction.REPLY, "GET /x", payload, "200"
    )


@given(PAYLOADS)
def test_every_payload_comes_back_byte_for_byte(payload: bytes) -> None:
    assert decode_exchange(encode_exchange(exchange(payload))) == exchange(payload)


def test_json_stands_in_the_file_as_json() -> None:
    kept = json.loads(encode_exchange(exchange(b'POST /x\n\n{"a": [1, 2.50]}')))
    assert kept["json"] == {"a": [1, 2.5]}
    assert kept["text"] == "POST /x\n\n"


SECRET = st.text(st.characters(codec="utf-8", exclude_characters='\\"'), min_size=4, max_size=30)


@given(SECRET, st.sampled_from(["password", "wifi_password", "token", "SSID"]), st.integers(0, 2))
def test_secrets_are_redacted_however_deeply_they_are_quoted(secret: str, field: str, wrapped: int) -> None:
    secret = f"#{secret}#"
    value = json.dumps({field: secret, "x": 1})
    for _ in range(wrapped):
        value = json.dumps({"params": value, "y": 2})
    redacted = Redaction()(value.encode()).decode()
    assert json.dumps(secret)[1:-1] not in redacted
    found = json.loads(redacted)
    for _ in range(wrapped):
        found = json.loads(found["params"])
    assert found == {field: "[redacted]", "x": 1}


def test_only_secrets_in_queries_and_numbers_are_redacted() -> None:
    redact = Redaction(("token", "pin"))
    assert redact(b"GET /x?token=abc&y=2\n\n") == b"GET /x?token=[redacted]&y=2\n\n"
    assert redact(b'{"pin": 1234, "pinned": true}') == b'{"pin": "[redacted]", "pinned": true}'
    assert redact(b"chassis move x 1;") == b"chassis move x 1;"


def test_values_of_the_model_become_json() -> None:
    value = {"a": float("inf"), "b": b"xx", "c": (1, {2}), "d": Direction.PUSH}
    assert json.loads(encode_plain(value)) == {"a": "inf", "b": {"bytes": 2}, "c": [1, [2]], "d": "push"}


@given(st.binary(max_size=200), st.sampled_from(FIELDS), st.booleans())
def test_every_field_is_found(around: bytes, field: str, upper: bool) -> None:
    name = field.upper() if upper else field
    said = around + b' {"%s": "Xanthippe"}' % name.encode()
    assert Redaction()(said).endswith(b'[redacted]"}')


def test_refusals_do_not_quote_names() -> None:
    refused = exchange(b'{"result": 5910}')._replace(
        door="driver/cyberdog", operation="7001", refusal="no face of 'Xanthippe' is known"
    )
    assert Redaction().exchange(refused).refusal == "no face of [redacted] is known"
    assert Redaction().exchange(refused._replace(operation="6004")).refusal == refused.refusal
