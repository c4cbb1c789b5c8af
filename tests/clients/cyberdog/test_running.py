"""The stream of a task that breaks, or talks nonsense, as the client takes it: no robot is needed for that."""

import json
from collections.abc import AsyncGenerator, Iterator, Mapping

import pytest

from roboglot.clients.cyberdog import CyberDogClient, TaskFailed, running
from roboglot.clients.errors import BadAnswer, LinkLost
from roboglot.wire.cyberdog.codes import Accepted, Code, TaskResult

Said = Mapping[str, int] | str | None  # None: the stream breaks
Streams = list[tuple[Code, list[Said]]]
BEGUN: list[Said] = [{"accepted": Accepted.YES}, {"feedback_code": 300}]


@pytest.fixture(autouse=True)
def hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "REJOIN_PERIOD", 0.0)


def talking(streams: Iterator[tuple[Code, list[Said]]]) -> CyberDogClient:
    """Return a client whose requests are answered by these streams, in this order."""
    client = CyberDogClient("127.0.0.1", None, app_port=None)

    async def send(code: int, text: str) -> AsyncGenerator[tuple[int, str], None]:
        asked, said = next(streams)
        assert code == asked
        for each in said:
            if each is None:
                raise LinkLost("the stream broke")
            yield code, each if isinstance(each, str) else json.dumps(each)

    setattr(client.link, "send", send)  # noqa: B010 - a method
    return client


async def test_a_task_whose_stream_breaks_is_joined_again() -> None:
    end: list[Said] = [{"accepted": Accepted.YES}, {"feedback_code": 308}, {"result": TaskResult.SUCCESS}]
    streams: Streams = [
        (Code.START_TASK, [*BEGUN, None]),
        (Code.JOIN_TASK, [None]),
        (Code.JOIN_TASK, end),
    ]
    heard: list[int] = []
    task = await talking(iter(streams)).navigate(1.0, 0.0, on_feedback=heard.append)
    await task
    assert heard == [300, 308]


async def test_task_that_vanished_has_not_succeeded() -> None:
    streams: Streams = [
        (Code.START_TASK, [*BEGUN, None]),
        (Code.JOIN_TASK, [{"accepted": Accepted.NOTHING_TO_JOIN}]),
    ]
    task = await talking(iter(streams)).navigate(1.0, 0.0)
    with pytest.raises(TaskFailed) as failed:
        await task
    assert failed.value.feedback == 300


@pytest.mark.parametrize("nonsense", ["what?", '{"accepted": "perhaps"}'])
async def test_nonsense_is_reported_at_once(nonsense: str) -> None:
    with pytest.raises(BadAnswer):
        await talking(iter([(Code.START_TASK, [nonsense])])).navigate(1.0, 0.0)
    task = await talking(iter([(Code.START_TASK, [*BEGUN, nonsense])])).navigate(1.0, 0.0)
    with pytest.raises(BadAnswer):
        await task
