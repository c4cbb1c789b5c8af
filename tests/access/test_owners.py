"""Programs that start by themselves, at their time: with the rights that their owner has then."""

from __future__ import annotations

import pytest

from roboglot.access.store import AccessStore
from roboglot.clients.visual import TextLink
from roboglot.model.client_context import identity
from roboglot.model.clock import LockstepClock
from roboglot.operations import Right
from roboglot.runtime import Runtime
from tests.access.matrix import CALLERS, frame_states, open_frames

OWNER = next(caller for caller in CALLERS if caller.name == "program")
OTHER = next(caller for caller in CALLERS if caller.name == "admin")
MINUTE = 60.0


async def each_minute(link: TextLink) -> None:
    """Save a task that does next to nothing, and have it run every minute."""
    body = "cyberdog.motion.resume_standing()\nprint('done')\n"
    common = {"type": "task", "target_id": ["patrol"], "mode": "cycle", "condition": "* * * * *"}
    states = await frame_states(link, [{**common, "operate": "save", "body": body}, {**common, "operate": "run"}])
    assert [state for state, _ in states] == [0, 0], states


async def test_task_has_its_owners_rights_until_they_end(
    runtime: Runtime, store: AccessStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, robot = runtime.clock, runtime.fleet.robots["a"]
    assert isinstance(clock, LockstepClock)
    link = await open_frames(OWNER.address)
    assert link is not None
    await each_minute(link)
    await link.close()
    other = await open_frames(OTHER.address)  # the last client is not the program's owner
    assert other is not None
    await frame_states(other, [{"type": "task", "operate": "inquiry", "target_id": []}])
    asked: list[str] = []
    check = robot.admission.check

    def note(door: str, operation: str, right: Right) -> None:
        asked.append(identity())
        check(door, operation, right)

    monkeypatch.setattr(robot.admission, "check", note)
    while not asked:
        await clock.advance(1.0)
    assert set(asked) == {OWNER.address}
    store.revoke(OWNER.address)
    assert runtime.guard is not None
    runtime.guard.reload()
    asked.clear()
    await clock.advance(1.2 * MINUTE)
    assert asked == []
    link = await open_frames(OTHER.address)
    assert link is not None
    await link.close()
    await other.close()
