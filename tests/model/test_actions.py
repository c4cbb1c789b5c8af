"""Actions: one per resource, replaced or refused, paused, cancelled, remembered."""

from __future__ import annotations

import asyncio
import logging

import pytest

from roboglot.model.actions import HISTORY_MAX, Action, Actions, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.errors import NotFound, Refused, Unreachable
from roboglot.model.events import ActionChanged, EventStream


@pytest.fixture
def events() -> EventStream:
    return EventStream()


@pytest.fixture
def clock() -> LockstepClock:
    return LockstepClock()


@pytest.fixture
def actions(clock: LockstepClock, events: EventStream) -> Actions:
    return Actions(clock, events)


async def forever(_: Action) -> None:
    await asyncio.get_running_loop().create_future()


async def test_it_goes_from_accepted_to_succeeded(actions: Actions, clock: LockstepClock, events: EventStream) -> None:
    seen: list[ActionStatus] = []
    events.listen(ActionChanged, lambda event: seen.append(event.action.status))

    async def run(action: Action) -> None:
        await clock.sleep(2)
        action.report("half")
        action.report("half")
        await clock.sleep(2)

    action = actions.start("move", run, resources=["base"])
    assert action.status is ActionStatus.ACCEPTED
    await clock.advance(4)
    assert action.status is ActionStatus.SUCCEEDED
    assert (action.reason, action.ended_at) == ("", 4)
    executing = ActionStatus.EXECUTING
    assert seen == [ActionStatus.ACCEPTED, executing, executing, ActionStatus.SUCCEEDED]  # "half" is reported once


async def test_new_one_waits_until_old_one_has_braked(actions: Actions, clock: LockstepClock) -> None:
    trace = []

    async def slow_to_brake(_: Action) -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            await clock.sleep(0.5)
            trace.append(("still", clock.time()))

    async def next_one(_: Action) -> None:
        trace.append(("next", clock.time()))

    old = actions.start("old", slow_to_brake, resources=["base"])
    await clock.advance(1)
    new = actions.start("new", next_one, resources=["base", "legs"])
    assert old.status is ActionStatus.CANCELING
    await clock.advance(1)
    assert trace == [("still", 1.5), ("next", 1.5)]
    assert (old.status, old.reason) == (ActionStatus.CANCELED, "new took over")
    assert new.status is ActionStatus.SUCCEEDED


async def test_one_that_never_ran_can_be_cancelled(actions: Actions) -> None:
    action = actions.start("move", forever, resources=["base"])
    action.cancel("changed my mind")
    assert await action.done() is ActionStatus.CANCELED
    assert actions.running() == []


async def test_other_resources_are_left_alone(actions: Actions) -> None:
    holder = actions.start("hold", forever, resources=["base"])
    other = actions.start("light", forever, resources=["light"])
    assert actions.running() == [holder, other]
    await actions.cancel()


async def test_failure_carries_its_reason(actions: Actions) -> None:
    async def fail(_: Action) -> None:
        raise Unreachable("a wall all around")

    action = actions.start("go", fail, resources=[])
    assert await action.done() is ActionStatus.ABORTED
    assert action.reason == "a wall all around"
    with pytest.raises(Unreachable):
        await action.succeeded()


async def test_bug_in_action_aborts_it_and_is_logged(actions: Actions, caplog: pytest.LogCaptureFixture) -> None:
    async def broken(_: Action) -> None:
        raise ZeroDivisionError("oops")

    with caplog.at_level(logging.ERROR):
        assert await actions.start("go", broken, resources=[]).done() is ActionStatus.ABORTED
    assert "go #1 crashed" in caplog.text


async def test_paused_it_brakes_and_waits(actions: Actions, clock: LockstepClock) -> None:
    braked = []
    steps = []

    async def run(action: Action) -> None:
        for step in range(3):
            await action.hold(lambda: braked.append(clock.time()))
            steps.append((step, clock.time()))
            await clock.sleep(1)

    action = actions.start("walk", run, resources=["base"], pausable=True)
    await clock.advance(0.5)
    action.pause()
    await clock.advance(9.5)
    assert (steps, braked, action.paused) == ([(0, 0)], [1], True)
    action.resume()
    await clock.advance(3)
    assert steps == [(0, 0), (1, 10), (2, 11)]
    assert action.status is ActionStatus.SUCCEEDED


async def test_paused_it_can_be_cancelled(actions: Actions, clock: LockstepClock) -> None:
    async def run(action: Action) -> None:
        await action.hold(lambda: None)

    action = actions.start("walk", run, resources=["base"], pausable=True)
    action.pause()
    await clock.advance(1)
    action.cancel()
    assert await action.done() is ActionStatus.CANCELED
    assert not action.paused


async def test_unpausable_action_refuses_a_pause(actions: Actions, clock: LockstepClock) -> None:
    """It was shown as paused while it went on."""
    action = actions.start("say", lambda _: clock.sleep(2), resources=["speaker"])
    with pytest.raises(Refused, match="say cannot be paused"):
        action.pause()
    assert not action.paused
    await clock.advance(3)
    assert action.status is ActionStatus.SUCCEEDED


async def test_only_a_clients_own_actions_end_with_it(actions: Actions) -> None:
    mine = actions.start("a", forever, resources=["base"], source="door 1")
    other = actions.start("b", forever, resources=["light"], source="door 2")
    await actions.cancel(source="door 1")
    assert (mine.status, other.status) == (ActionStatus.CANCELED, ActionStatus.EXECUTING)
    await actions.cancel()


async def test_the_last_twenty_are_remembered(actions: Actions) -> None:
    async def nothing(_: Action) -> None: ...

    for _ in range(HISTORY_MAX + 5):
        await actions.start("n", nothing, resources=[]).done()
    assert [a.id for a in actions.history] == list(range(6, HISTORY_MAX + 6))
    assert actions.get(HISTORY_MAX + 5).status is ActionStatus.SUCCEEDED
    with pytest.raises(NotFound):
        actions.get(5)


async def test_one_that_has_returned_serves_no_request(actions: Actions) -> None:
    """Its status still shows it running when a request comes in the very turn in which its code returns."""
    seen: list[tuple[ActionStatus, bool]] = []

    async def run(action: Action) -> None:
        look = lambda: seen.append((action.status, action.may_go_on("door")))  # noqa: E731
        look()
        asyncio.get_running_loop().call_soon(look)

    await actions.start("drive", run, resources={"base"}, source="door").done()
    assert seen == [(ActionStatus.EXECUTING, True), (ActionStatus.EXECUTING, False)]
