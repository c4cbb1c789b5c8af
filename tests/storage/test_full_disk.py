"""A robot whose disk is full reads what it has and keeps nothing new; the others do not notice."""

import pytest

from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Refused


@pytest.mark.world("empty", robots=("a", "b"))
async def test_writing_is_refused_until_there_is_room_again(fleet, world):
    first, second = fleet.robots["a"][Settings], fleet.robots["b"][Settings]
    await first.put("kept", 1)
    (fault,) = world.faults.inject("full_disk", "a")
    with pytest.raises(Refused, match="disk is full"):
        await first.put("kept", 2)
    with pytest.raises(Refused, match="disk is full"):
        await fleet.robots["a"][Places].clear()
    assert first.get("kept") == 1
    await second.put("kept", 3)
    assert second.get("kept") == 3
    world.faults.clear(fault.number)
    await first.put("kept", 4)
    assert first.get("kept") == 4
