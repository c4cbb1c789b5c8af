"""Requests and answers are found in the bytes of a connection, in all forms that the protocols allow."""

import gzip
import json

import pytest
from wsproto.connection import Connection, ConnectionType
from wsproto.events import Message, TextMessage
from wsproto.extensions import Extension, PerMessageDeflate

from roboglot.model.tap import PAYLOAD_MAX, Direction
from roboglot.recording.proxy.sniffers import FrameSniffer, RestSniffer, TextSniffer

AGREED = "permessage-deflate; server_max_window_bits=12; client_max_window_bits=12"


class Noted(list[tuple[str, bytes, str]]):
    """Operation, payload and status of each exchange."""

    def __call__(self, _: Direction, operation: str, payload: bytes, status: str, began: float | None) -> float:
        self.append((operation, payload, status))
        return began or 0.0


def http(head: str, body: bytes = b"") -> bytes:
    return head.replace("\n", "\r\n").encode() + b"\r\n\r\n" + body


def test_pieces_of_any_size_are_put_together() -> None:
    noted = Noted()
    text = TextSniffer(noted)
    for byte in b"version;chassis speed ?;":
        text.from_client(bytes([byte]))
    for byte in b"version 1;fail;":
        text.from_robot(bytes([byte]))
    assert noted[2:] == [("version", b"version 1;", "ok"), ("chassis speed ?", b"fail;", "fail")]
    noted.clear()
    rest = RestSniffer(noted)
    for byte in http("POST /a?b=1 HTTP/1.1\nhost: x\ncontent-length: 2", b"{}"):
        rest.from_client(bytes([byte]))
    for byte in http("HTTP/1.1 404 Not Found\ntransfer-encoding: chunked", b"3\r\nabc\r\n0\r\n\r\n"):
        rest.from_robot(bytes([byte]))
    assert noted == [("", b"POST /a?b=1\n\n{}", ""), ("", b"abc", "404")]


def test_answer_to_head_has_no_body() -> None:
    noted = Noted()
    rest = RestSniffer(noted)
    rest.from_client(http("HEAD /a HTTP/1.1"))
    rest.from_robot(http("HTTP/1.1 200 OK\ncontent-length: 5"))
    rest.from_client(http("GET /a HTTP/1.1"))
    rest.from_robot(http("HTTP/1.1 200 OK\ncontent-length: 5", b"hello"))
    assert noted == [("", b"HEAD /a\n\n", ""), ("", b"", "200"), ("", b"GET /a\n\n", ""), ("", b"hello", "200")]


def test_announcement_of_an_answer_is_none() -> None:
    noted = Noted()
    rest = RestSniffer(noted)
    rest.from_client(http("PUT /a HTTP/1.1\nexpect: 100-continue\ncontent-length: 1"))
    rest.from_robot(http("HTTP/1.1 100 Continue"))
    rest.from_client(b"x")
    rest.from_robot(http("HTTP/1.1 400 Bad Request\ncontent-length: 2", b"no"))
    assert noted == [("", b"PUT /a\n\nx", ""), ("", b"no", "400")]


@pytest.mark.parametrize(("size", "found"), [("", [("", b"all of it", "200")]), ("\ncontent-length: 100", [])])
def test_connection_s_end_ends_answers_without_size(size: str, found: list[object]) -> None:
    noted = Noted()
    rest = RestSniffer(noted)
    rest.from_client(http("GET /a HTTP/1.0"))
    rest.from_robot(http(f"HTTP/1.0 200 OK{size}", b"all of it"))
    rest.from_robot(b"")
    rest.from_robot(b"")
    assert noted[1:] == found


def test_packed_answer_is_noted_unpacked() -> None:
    """No redaction looks into packed bytes."""
    noted = Noted()
    rest = RestSniffer(noted)
    body = gzip.compress(b'{"ssid":"home"}')
    rest.from_client(http("GET /a HTTP/1.1"))
    rest.from_robot(http(f"HTTP/1.1 200 OK\ncontent-encoding: GZIP\ncontent-length: {len(body)}", body))
    assert noted[1:] == [("", b'{"ssid":"home"}', "200")]


def frames(agreed: str = "") -> tuple[FrameSniffer, Connection, Connection, Noted]:
    """Return a connection after its handshake: the sniffer, both ends, and what is noted."""
    noted, ends = Noted(), list[Connection]()
    sniffer = FrameSniffer(noted)
    for kind in (ConnectionType.CLIENT, ConnectionType.SERVER):
        unpacking = list[Extension]()
        if agreed:
            unpacking.append(PerMessageDeflate())
            unpacking[0].finalize(agreed)
        ends.append(Connection(kind, unpacking))
    sniffer.from_client(http("GET /programs HTTP/1.1\nupgrade: websocket"))
    extension = f"\nSec-WebSocket-Extensions: {agreed}" if agreed else ""
    sniffer.from_robot(http(f"HTTP/1.1 101 Switching Protocols{extension}\nConnection: Upgrade"))
    return sniffer, ends[0], ends[1], noted


def said(text: str) -> Message[str]:
    return TextMessage(data=text, message_finished=True)


@pytest.mark.parametrize("agreed", ["", AGREED])
def test_frames_are_read_with_and_without_compression(agreed: str) -> None:
    sniffer, client, robot, noted = frames(agreed)
    for number in range(3):  # later ones refer to the first
        asked = {"type": "module", "id": f"m{number}", "target_id": ["m"], "operate": "inquiry", "mode": "common"}
        sniffer.from_client(client.send(said(json.dumps({**asked, "describe": "x" * 300}))))
        sniffer.from_robot(robot.send(said(json.dumps({"feedback": {"id": f"m{number}", "state": 0}}))))
    assert [(operation, status) for operation, _, status in noted] == [
        ("module inquiry", ""),
        ("module inquiry", "ok"),
    ] * 3


def test_message_without_an_end_is_given_up() -> None:
    sniffer, client, _, _ = frames(AGREED)
    packed = client.send(said("x" * (PAYLOAD_MAX + 1)))
    assert len(packed) < PAYLOAD_MAX / 100
    with pytest.raises(ValueError, match="no end"):
        sniffer.from_client(packed)
