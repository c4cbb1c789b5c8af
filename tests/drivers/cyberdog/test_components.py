"""Components of a dog but legs and lidar, through a driver: a simulated dog behind its gRPC door, in real time."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboglot.confirmation import confirmed
from roboglot.media.video import VideoStream
from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.interaction.skin import (
    ElectronicSkin,
    Patch,
    Shade,
    SkinPattern,
)
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.camera import Camera, Frame
from roboglot.model.components.system.network import Network
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.events import Spoke
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.model.robot import Robot
from roboglot.model.sound import tone
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from roboglot.testing import Forward
from roboglot.testing.addresses import free_port
from tests.drivers.clients import Drive
from tests.drivers.rig import time_passes

pytestmark = pytest.mark.world("empty", body="cyberdog2")
PATIENCE = 60  # real s


@pytest.fixture
async def frames(robot: Robot) -> AsyncIterator[VisualDoor]:
    """The dog runs programs."""
    database = Database(":memory:")
    async with Engine() as engine:
        visual = VisualDoor(ProgramService(robot, engine, program_stores(database, robot.id)))
        await visual.start()
        yield visual
        await visual.close()
    database.close()


@pytest.fixture
async def labelled(robot: Robot) -> Robot:
    """The dog has a map with a label."""
    grid = OccupancyGrid(np.full((20, 20), -50, np.int8), 0.05, Point())
    await robot[MapLibrary].put(StoredMap("home", grid, 1.0, labels=(Label("kitchen", Point(0.5, 0.25)),)))
    return robot


@pytest.fixture
async def driven(
    robot: Robot, frames: VisualDoor, drive: Drive, forward: Forward, tmp_path: Path
) -> AsyncIterator[Robot]:
    """Robot time passes by itself."""
    config = CyberDogConfig(port=0, app_port=free_port())
    door = CyberDogDoor(robot, "127.0.0.1", config, tmp_path, frames=frames)
    export_client(tmp_path / "cyberdog", tmp_path / "driver")
    await door.start()
    async with time_passes(forward):
        yield await drive(f"cyberdog://127.0.0.1:{door.port}?certs={tmp_path / 'driver'}&app={config.app_port}")
        await door.close()


def likeness(one: Frame, other: Frame) -> float:
    """Correlation of their coarse brightness: 1 for the same picture, about 0 for strangers."""
    small = [frame.luma[: 720 // 16 * 16].reshape(45, 16, 80, 16).mean(axis=(1, 3)).ravel() for frame in (one, other)]
    return float(np.corrcoef(*small)[0, 1])


@pytest.mark.world("office", body="cyberdog2")
async def test_its_pictures_and_photos_are_what_dog_sees(driven: Robot, robot: Robot) -> None:
    camera = driven[Camera]
    assert VideoStream in driven
    async with asyncio.timeout(PATIENCE):
        photo, real = await camera.capture(), await robot[Camera].capture()
        assert likeness(photo, real) > 0.97
        with camera.subscribe() as pictures:
            live = await anext(pictures)
        assert likeness(live, real) > 0.9
    assert (live.width, live.height) == (camera.width, camera.height)
    with pytest.raises(Refused):
        camera.set_exposure(1.0)


@pytest.mark.slow
async def test_battery_motors_network_and_power_are_reported(driven: Robot, robot: Robot) -> None:
    near, far = driven[Battery].state, robot[Battery].state
    assert (near.voltage, near.capacity) == pytest.approx((far.voltage, far.capacity), rel=0.02)
    assert near.temperature == pytest.approx(far.temperature, abs=1)
    assert driven[Motors].temperatures.keys() == robot[Motors].temperatures.keys()
    assert driven[Motors].hottest == pytest.approx(robot[Motors].hottest, abs=1)
    network, real = driven[Network], robot[Network]
    assert (network.state.ssid, network.state.mac) == (real.state.ssid, real.state.mac)
    assert (network.connected, network.state.internet) == (real.connected, real.state.internet)
    with pytest.raises(Refused):
        network.join("home", "12345678")
    power = driven[Power]
    async with asyncio.timeout(PATIENCE):
        await power.set_automatic(not robot[Power].automatic)
        assert power.automatic == robot[Power].automatic
        saving = robot[Power].save()
        assert await saving.done() is ActionStatus.SUCCEEDED
        while power.mode is not PowerMode.LOW_POWER:
            await driven.clock.sleep(0.1)
        waking = power.wake(source="test")
        assert await waking.done() is ActionStatus.SUCCEEDED, waking.reason
    assert robot[Power].mode is PowerMode.AWAKE
    with pytest.raises(Refused):
        power.sleep()


async def test_it_speaks_as_loudly_as_asked(driven: Robot, robot: Robot) -> None:
    speaker, said = driven[Speaker], list[str]()
    robot.events.listen(Spoke, lambda event: said.append(event.text))
    async with asyncio.timeout(PATIENCE):
        await speaker.set_volume(0.35)
        while speaker.volume != pytest.approx(0.35):
            await driven.clock.sleep(0.05)
        assert robot[Speaker].volume == pytest.approx(0.35)
        speaking = speaker.say('It\'s "here"', source="test")
        assert await speaking.done() is ActionStatus.SUCCEEDED, speaking.reason
    assert said == ['It\'s "here"']
    with pytest.raises(InvalidGoal):
        speaker.say(" ")
    with pytest.raises(Refused):
        speaker.play(tone(440.0, 0.1))


async def test_labels_of_its_map_are_places_here(labelled: Robot, driven: Robot) -> None:
    near, library = driven[Places], labelled[MapLibrary]
    ((kitchen),) = near.all()
    assert (kitchen.metadata["display_name"], kitchen.pose) == ("kitchen", Pose(0.5, 0.25))

    async def labels_are(**wanted: Point) -> None:
        async with asyncio.timeout(PATIENCE):
            while {label.name: label.point for label in (await library.get("home")).labels} != wanted:
                await driven.clock.sleep(0.05)

    hall = PointOfInterest("hall-1", Pose(0.75, 0.5, 1.0), {"display_name": "hall"})
    await near.put(hall)
    await labels_are(kitchen=Point(0.5, 0.25), hall=Point(0.75, 0.5))
    assert near.get("hall-1") == hall  # the heading stays; labels have none
    await near.put(replace(kitchen, pose=Pose(0.1, 0.2)))
    await labels_are(kitchen=Point(0.1, 0.2), hall=Point(0.75, 0.5))
    await near.remove(kitchen.id)
    await labels_are(hall=Point(0.75, 0.5))
    assert list(near.all()) == [hall]
    await near.put(replace(hall, metadata={"display_name": "lobby"}))
    await labels_are(lobby=Point(0.75, 0.5))
    await near.remove("hall-1")  # an id of ours, which a label has not
    await labels_are()
    assert list(near.all()) == []


async def test_refused_skin_stays_as_it_was(driven: Robot, robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    near, far = driven[ElectronicSkin], robot[ElectronicSkin]
    async with confirmed():
        near.show(SkinPattern.REARWARD, cycle=1.5)
    before = near.state
    assert far.state.pattern is SkinPattern.REARWARD

    def refuse(*_: object, **__: object) -> None:
        raise Refused("not now")

    monkeypatch.setattr(far, "show", refuse)

    async def show_twice() -> None:
        async with confirmed():
            near.show(SkinPattern.FLASH)
            near.show(SkinPattern.LIGHT)

    with pytest.raises(Refused):
        await show_twice()
    assert near.state == before


async def test_its_skin_shows_what_it_is_given(driven: Robot, robot: Robot) -> None:
    near, far = driven[ElectronicSkin], robot[ElectronicSkin]

    async def becomes(**wanted: object) -> None:
        async with asyncio.timeout(PATIENCE):
            while any(getattr(far.state, name) != value for name, value in wanted.items()):
                await driven.clock.sleep(0.05)

    near.show(SkinPattern.REARWARD, cycle=1.5)
    await becomes(pattern=SkinPattern.REARWARD, cycle=1.5)
    near.show(SkinPattern.FOOTFALLS, standing=Shade.DARK)
    await becomes(pattern=SkinPattern.FOOTFALLS, standing=Shade.DARK)
    assert set(near.shades) == {Patch.FRONT, Patch.MIDDLE, Patch.REAR}  # the feet are not reported
    near.enable(False)
    await becomes(enabled=False)
    with pytest.raises(InvalidGoal):
        near.show(SkinPattern.FLASH, cycle=0.0)
