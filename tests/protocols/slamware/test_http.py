"""The door as an HTTP server: routes, errors in the vendor's form, hostile clients. No robot moves here."""

import asyncio
import sys
from urllib.parse import quote

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.extras import MissingExtra
from roboglot.model.robot import Robot
from roboglot.operations import OperationTable
from roboglot.protocols.slamware import parameters
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.errors import reason_phrase
from roboglot.protocols.slamware.http_connection import JOINED_MAX, ReasonTransport, with_reason
from roboglot.protocols.slamware.routes import BEYOND, Routes
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.protocols.slamware.table import TABLE, implemented
from roboglot.wire.contracts import contract
from tests.protocols.held_fairness import held, until

ROWS = contract("slamware")
ACTIONS = "/api/core/motion/v1/actions"
POIS = "/api/core/artifact/v1/pois"


def test_every_handler_is_in_the_contract() -> None:
    beyond = {row.key for row in BEYOND}
    assert {operation.key for operation in TABLE} - beyond <= {row.key for row in ROWS}
    assert implemented() < {row.key for row in ROWS}
    others = [operation for operation in TABLE if operation.key not in implemented() | beyond]
    assert all(operation.partial for operation in others)


async def test_a_door_without_its_library_does_not_open(bare: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)  # as if not installed
    with pytest.raises(MissingExtra, match=r"needs uvicorn, .* pip install 'roboglot\[slamware\]'"):
        await SlamwareDoor(bare, "127.0.0.1", SlamwareConfig(port=0)).start()


async def test_missing_things_are_reported_by_name(
    bare_client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("roboglot.protocols.slamware.dispatch.TABLE", OperationTable("none"))
    for row in ROWS:
        method, path = row.key.split(" ")
        reply = await bare_client.request(method, path.replace("{", "").replace("}", ""))
        assert reply.status_code == 501, row.key
        assert reply.reason_phrase == f"{row.name} is not implemented"
        assert row.name in reply.text


async def test_client_beyond_its_share_waits_but_to_stop(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    fairness = held(bare)
    fairness.on = True
    asking = asyncio.ensure_future(bare_client.get(POIS))
    await until(lambda: len(fairness.waited) > 3)
    assert not asking.done()
    assert (await bare_client.delete(f"{ACTIONS}/:current")).status_code == 200
    assert not asking.done()
    fairness.on = False
    assert (await asking).status_code == 200
    assert fairness.waited[0].startswith("127.0.0.1:")
    assert set(fairness.counted) == set(fairness.waited)


def test_literals_win_over_parameters() -> None:
    routes = Routes(ROWS)
    for row in ROWS:
        method, path = row.key.split(" ")
        found = routes.find(path)
        assert found is not None
        assert found.methods[method].name == row.name
    found = routes.find("/api/delivery/v1/cargos/7/boxes/8/:open")
    assert found is not None
    assert found.methods["PUT"].name == "operateBox"
    assert found.values == {"cargo_id": "7", "box_id": "8", "op": ":open"}
    assert routes.find("/api/core/slam/v1") is None


@pytest.mark.parametrize("id", ["a/b", "50%", "100%2F", "大厅", "a b?c#d", "x:y", "😀" * 64])
async def test_every_accepted_id_can_be_requested(bare_client: httpx.AsyncClient, id: str) -> None:
    assert (await bare_client.post(POIS, json={"id": id, "pose": {"x": 1, "y": 2}})).status_code == 200
    one = f"{POIS}/{quote(id, safe='')}"
    assert (await bare_client.get(one)).json()["id"] == id
    assert (await bare_client.put(one, json={"metadata": {"a": "b"}})).json() is True
    assert (await bare_client.delete(one)).json() is True
    assert (await bare_client.get(POIS)).json() == []


@pytest.mark.parametrize("id", ["a\0b", "\n", "a\n", ":adjust", "\x7f"])
async def test_ids_that_cannot_stand_in_paths_are_refused(bare_client: httpx.AsyncClient, id: str) -> None:
    assert (await bare_client.post(POIS, json={"id": id, "pose": {"x": 1, "y": 2}})).status_code == 400
    assert (await bare_client.get(POIS)).json() == []


async def test_empty_list_is_no_metadata_as_documented(bare_client: httpx.AsyncClient) -> None:
    place = {"id": "a", "pose": {"x": 1, "y": 2}}
    assert (await bare_client.post(POIS, json={**place, "metadata": []})).status_code == 200
    for metadata in (["a"], [[]], [None], "a", 5):
        assert (await bare_client.post(POIS, json={**place, "metadata": metadata})).status_code == 400


@pytest.mark.parametrize("colon", [":", "%3A", "%3a"])
async def test_colons_come_raw_or_escaped(bare_client: httpx.AsyncClient, colon: str) -> None:
    url = httpx.URL(f"{str(bare_client.base_url).rstrip('/')}{ACTIONS}/{colon}current")
    assert (await bare_client.delete(url)).status_code == 200
    assert (await bare_client.get(url)).status_code == 404


async def test_errors_stand_in_reason_phrase_and_body(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.post(ACTIONS, json={"action_name": "slamtec.agent.actions.DanceAction", "options": {}})
    assert (reply.status_code, reply.reason_phrase) == (400, "Can not create action")
    assert reply.headers["content-type"].startswith("text/plain")
    assert reply.text.startswith("Can not create action")
    assert "reason-phrase" not in reply.headers


def test_reason_phrases_are_harmless() -> None:
    assert reason_phrase("a\r\nSet-Cookie: x\x00é") == b"a??Set-Cookie: x??"
    assert len(reason_phrase("x" * 1000)) <= 160
    head = b"HTTP/1.1 400 Bad Request\r\na: b\r\nreason-phrase: Nope\r\nc: d\r\n\r\n"
    assert with_reason(head) == b"HTTP/1.1 400 Nope\r\na: b\r\nc: d\r\n\r\n"
    assert with_reason(b"HTTP/1.1 200 OK\r\na: b\r\n\r\n") == b"HTTP/1.1 200 OK\r\na: b\r\n\r\n"


class Pieces(asyncio.Transport):
    """Keep what is written, piece by piece."""

    def __init__(self) -> None:
        super().__init__()
        self.all: list[bytes] = []

    def is_closing(self) -> bool:
        return False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.all.append(bytes(data))

    def close(self) -> None:
        self.all.append(b"closed")


async def test_heads_go_out_with_their_bodies() -> None:
    head, large = b"HTTP/1.1 200 OK\r\na: b\r\n\r\n", bytes(JOINED_MAX + 1)
    transport = ReasonTransport(pieces := Pieces())
    for data in (head, b"body", b"more", head, b"", head, large):
        transport.write(data)
    assert pieces.all == [head + b"body", b"more", head, head, large]
    pieces.all.clear()
    transport.write(head)  # the answer to a HEAD
    transport.flush()
    transport.write(b"HTTP/1.1 100 Continue\r\n\r\n")  # the client waits for it
    transport.write(head)
    transport.close()
    assert pieces.all == [head, b"HTTP/1.1 100 Continue\r\n\r\n", head, b"closed"]
    pieces.all.clear()
    transport.write(head)  # of an answer whose body comes later
    await asyncio.sleep(0)
    assert pieces.all == [head]
    transport.write(b"body")
    assert pieces.all == [head, b"body"]


async def test_a_head_alone_is_answered_at_once(bare_client: httpx.AsyncClient) -> None:
    for _ in range(2):
        reply = await bare_client.head(POIS)
        assert (reply.status_code, reply.content) == (200, b"")


BAD_BODIES = [b"", b"{", b"[]", b"null", b"7", b'"x"', b"\xff\xfe", b"[" * 50_000, b'{"id": 5}', b'{"id": ""}']


async def test_bad_bodies_are_400(bare_client: httpx.AsyncClient) -> None:
    for body in BAD_BODIES:
        reply = await bare_client.post(POIS, content=body)
        assert (reply.status_code, reply.reason_phrase) == (400, "Bad Request"), body[:20]
        assert (await bare_client.get(POIS)).json() == [], body[:20]


async def test_the_error_names_the_field(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.post(POIS, json={"id": "a", "pose": {"x": 1, "y": "north"}})
    assert "pose.y must be a number, not text" in reply.text


async def test_a_missing_component_is_501(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.get("/api/core/slam/v1/localization/pose")
    assert (reply.status_code, reply.reason_phrase) == (501, "Not Implemented")
    assert "localization" in reply.text


async def test_unknown_paths_and_methods(bare_client: httpx.AsyncClient) -> None:
    assert (await bare_client.get("/nowhere")).status_code == 404
    assert (await bare_client.get("/api/core/artifact/v1/pois/a/b")).status_code == 404
    assert (await bare_client.get(f"{POIS}/" + "x" * 5000)).status_code == 404
    assert (await bare_client.patch(POIS)).status_code == 405
    assert (await bare_client.get(f"{POIS}/:adjust")).status_code == 405


async def test_pages_of_this_machine_may_ask(bare_client: httpx.AsyncClient) -> None:
    page = {"Origin": "http://localhost:3000"}
    reply = await bare_client.options(POIS, headers={**page, "Access-Control-Request-Method": "PUT"})
    assert reply.status_code == 200
    assert "PUT" in reply.headers["access-control-allow-methods"]
    for answer in (reply, await bare_client.get(POIS, headers=page), await bare_client.get("/no", headers=page)):
        assert answer.headers["access-control-allow-origin"] == page["Origin"]
        assert answer.headers["vary"] == "Origin"


async def test_pages_of_strangers_may_not_ask(bare_client: httpx.AsyncClient) -> None:
    for wish in (
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Host": "evil.example:1448"},
        {"Sec-Fetch-Site": "cross-site"},
    ):
        for method in ("OPTIONS", "GET", "DELETE"):
            reply = await bare_client.request(method, POIS, headers=wish)
            assert reply.status_code == 403
            assert "access-control-allow-origin" not in reply.headers
            assert "access-control-allow-methods" not in reply.headers


async def test_any_origin_is_one_line_of_configuration(bare: Robot, caplog: pytest.LogCaptureFixture) -> None:
    door = SlamwareDoor(bare, "127.0.0.1", SlamwareConfig(port=0, origins=("*",)))
    await door.start()
    assert "every web page" in caplog.text
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, verify=False) as client:
        reply = await client.get(POIS, headers={"Origin": "http://studio.example"})
        assert (reply.status_code, reply.headers["access-control-allow-origin"]) == (200, "*")
    await door.close()


async def test_empty_answers_are_empty_and_say_so(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.delete(f"{ACTIONS}/:current")
    assert (reply.status_code, reply.content, reply.headers["content-length"]) == (200, b"", "0")


async def test_bodies_are_bounded(bare_door: SlamwareDoor, bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.post(POIS, content=b"x" * (parameters.BODY_MAX + 1))
    assert reply.status_code == 413

    async def chunks():
        for _ in range(40):
            yield b"x" * 65536

    assert (await bare_client.post(POIS, content=chunks())).status_code == 413
    assert (await bare_client.get(POIS)).status_code == 200


async def test_an_address_in_use_is_named(bare: Robot, bare_door: SlamwareDoor) -> None:
    with pytest.raises(OSError, match=str(bare_door.port)):
        await SlamwareDoor(bare, "127.0.0.1", SlamwareConfig(port=bare_door.port)).start()


async def test_a_closed_door_is_closed(bare: Robot) -> None:
    door = SlamwareDoor(bare, "127.0.0.1", SlamwareConfig(port=0))
    await door.close()  # never opened: nothing to do
    await door.start()
    _, idle = await asyncio.open_connection("127.0.0.1", door.port)
    await door.close()
    idle.close()
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection("127.0.0.1", door.port)


async def test_many_requests_at_once_lose_none(bare_client: httpx.AsyncClient) -> None:
    replies = await asyncio.gather(
        *(bare_client.post(POIS, json={"id": f"p{i}", "pose": {"x": i, "y": 0}}) for i in range(100))
    )
    assert {reply.status_code for reply in replies} == {200}
    assert len((await bare_client.get(POIS)).json()) == 100


KEYS = st.sampled_from(["id", "pose", "x", "y", "yaw", "metadata", "action_name", "options", "enable"])
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["id", "pose", "x", "y", "yaw", "metadata", "action_name", "options", "enable"])
            | st.text(),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)
WITH_BODY = [operation.key for operation in TABLE if "body" in operation.names]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(key=st.sampled_from(WITH_BODY), value=JSON)
async def test_any_json_body_is_answered(bare_client: httpx.AsyncClient, key: str, value: object) -> None:
    method, path = key.split(" ")
    reply = await bare_client.request(method, path, json=value)
    assert reply.status_code in (200, 400, 404, 501), reply.text


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(min_size=1, max_size=200))
async def test_any_bytes_as_a_body_are_answered(bare_client: httpx.AsyncClient, data: bytes) -> None:
    assert (await bare_client.post(POIS, content=data)).status_code in (200, 400)


@pytest.mark.parametrize(
    "body", [pytest.param(body, marks=pytest.mark.world("empty", body=body)) for body in ("robomaster_ep", "hermes")]
)
async def test_start_screens_line_works_on_each_body(body: str, door: SlamwareDoor) -> None:
    async with httpx.AsyncClient() as client:
        assert (await client.get(door.endpoints[0].try_line.removeprefix("curl "))).status_code == 200, body
