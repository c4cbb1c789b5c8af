"""Firmware updates and reboots, power modes, the disk."""

from __future__ import annotations

from operator import ne

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.skin import ElectronicSkin, SkinPattern
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.system.disk import LOW, Disk
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage, FirmwareState
from roboglot.model.errors import Blocked, Busy, InvalidGoal, NotFound, Refused
from roboglot.model.events import DiskLow, FirmwareChanged, PowerModeChanged, Rebooted, Rebooting, ShuttingDown
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.components.system.firmware_record import FirmwareRecord

DIGEST = "0123456789abcdef" * 2


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(5, 5), body="cyberdog2")
    sim.world.start()
    return sim


WAYS = [  # to restart
    lambda robot: robot[Firmware].reboot(),
    pytest.param(lambda robot: robot[Power].shut_down(restart_after=1), marks=pytest.mark.slow),
]


def package(**changes):
    values = {"version": "2.0", "size": 200_000_000, "digest": DIGEST, "modules": {"motors.MCU_Motor": "2.0"}}
    return FirmwarePackage(**{**values, "url": "http://x/p", **changes})


async def downloaded(dog, **changes):
    action = dog.robot[Firmware].download(package(**changes))
    await dog.clock.advance(11.0)
    return action


async def test_an_update_from_the_download_to_the_reboot(dog):
    firmware, events = dog.robot[Firmware], dog.robot.events.subscribe(FirmwareChanged, Rebooting, Rebooted)
    assert (firmware.version, firmware.modules["motors.MCU_Motor"]) == ("1.3.0.0", "1.1.0")
    downloading = firmware.download(package())
    await dog.clock.advance(5.0)
    assert firmware.progress.state is FirmwareState.DOWNLOADING
    assert firmware.progress.share == pytest.approx(0.5, abs=0.03)
    assert firmware.remaining == pytest.approx(5.0 + 20.0, abs=0.5)
    assert "firmware package" in dog.robot[Disk].uses
    await dog.clock.advance(6.0)
    assert downloading.status is ActionStatus.SUCCEEDED
    installing = firmware.install(DIGEST)
    await dog.clock.advance(10.0)
    with pytest.raises(Refused):
        dog.robot[Base].set_velocity(Twist(0.1))
    await dog.clock.advance(11.0)
    assert (installing.status, firmware.progress.state) == (ActionStatus.SUCCEEDED, FirmwareState.INSTALLED)
    assert firmware.version == "1.3.0.0"  # until it restarts
    rebooting = firmware.reboot(after=2.0)
    await dog.clock.advance(10.0)
    assert firmware.progress.state is FirmwareState.REBOOTING
    await dog.clock.advance(20.0)
    assert rebooting.status is ActionStatus.SUCCEEDED
    assert (firmware.version, firmware.modules["motors.MCU_Motor"]) == ("2.0", "2.0")
    assert firmware.modules["r329.l91_audio"] == "1.2.1"
    dog.robot[Base].set_velocity(Twist())
    kinds = [type(event) for event in events.drain()]
    assert kinds.count(FirmwareChanged) > 200
    assert kinds.index(Rebooting) < kinds.index(Rebooted)


async def test_full_disk_keeps_no_robot_from_starting(dog, monkeypatch):
    """It restarted for ever, if an installed update could not be noted as the running one."""
    firmware = dog.robot[Firmware]
    await downloaded(dog)
    installing = firmware.install(DIGEST)
    await dog.clock.advance(21.0)
    assert installing.status is ActionStatus.SUCCEEDED

    async def full(*_):
        raise Refused("the disk is full")

    with monkeypatch.context() as patch:
        patch.setattr(FirmwareRecord, "_write", full)
        firmware.reboot()
        await dog.clock.advance(40.0)
    assert (firmware.version, firmware.progress.state) == ("2.0", FirmwareState.IDLE)
    dog.robot[Base].set_velocity(Twist())
    firmware.reboot()
    await dog.clock.advance(40.0)
    assert firmware.version == "2.0"


async def test_reboot_ends_work_and_continues_without_its_client(dog):
    walking = dog.robot[Legs].stand()
    rebooting = dog.robot[Firmware].reboot(source="someone")
    await dog.clock.advance(5.0)
    assert walking.status.ended
    assert dog.robot[Legs].posture is Posture.LYING
    rebooting.cancel()
    rebooted = dog.robot.events.subscribe(Rebooted)
    await dog.clock.advance(25.0)
    assert len(rebooted.drain()) == 1


@pytest.mark.parametrize("changes", [{"digest": "x"}, {"size": 0}, {"size": 5 * 1024**3}, {"version": ""}])
def test_packages_that_make_no_sense(dog, changes):
    with pytest.raises(InvalidGoal):
        dog.robot[Firmware].download(package(**changes))


async def test_updates_that_are_refused(dog):
    firmware = dog.robot[Firmware]
    nothing = firmware.install(DIGEST)
    await dog.clock.advance(0.1)
    assert isinstance(nothing.error, NotFound)
    dog.robot[Disk].take("recordings", dog.robot[Disk].free - 1000)
    full = firmware.download(package())
    await dog.clock.advance(0.1)
    assert isinstance(full.error, Refused)
    dog.robot[Disk].release("recordings")
    await downloaded(dog)
    other = firmware.install("f" * 32)
    await dog.clock.advance(0.1)
    assert isinstance(other.error, NotFound)
    dog.robot[Battery].set_charge(0.1)
    weak = firmware.install(DIGEST)
    await dog.clock.advance(0.1)
    assert isinstance(weak.error, Refused)


async def test_given_up_an_installation_leaves_the_old_version(dog):
    firmware = dog.robot[Firmware]
    await downloaded(dog)
    installing = firmware.install(DIGEST)
    await dog.clock.advance(10.0)
    installing.cancel()
    await dog.clock.advance(0.1)
    assert firmware.progress.state is FirmwareState.DOWNLOADED
    firmware.reboot()
    await dog.clock.advance(30.0)
    assert firmware.version == "1.3.0.0"
    dog.robot[Base].set_velocity(Twist())


async def test_the_network_goes_during_a_download(dog):
    firmware = dog.robot[Firmware]
    action = firmware.download(package())
    await dog.clock.advance(3.0)
    dog.world.faults.inject("wifi_loss", robot="a")
    await dog.clock.advance(3.0)
    assert isinstance(action.error, Blocked)
    assert firmware.progress.state is FirmwareState.FAILED
    assert "network" in firmware.progress.error


@pytest.mark.slow  # two minutes; tests/protocols/cyberdog/test_upkeep.py has an update
async def test_it_updates_itself_on_the_dock(dog):
    firmware = dog.robot[Firmware]
    assert firmware.available.version == "1.3.1.0"
    await firmware.set_automatic(True)
    await dog.clock.advance(130.0)
    assert firmware.version == "1.3.0.0"  # not on its dock
    dog.world.stage.place("a", Pose(0.12 + 0.25 + 0.005, 5.0))
    await dog.clock.advance(61.0 + 20.0 + 40.0 + 30.0)
    assert firmware.version == "1.3.1.0"
    assert firmware.available is None


async def test_low_power_lying_and_awake_again(dog):
    power, legs, events = dog.robot[Power], dog.robot[Legs], dog.robot.events.subscribe(PowerModeChanged)
    await dog.clock.advance(1.0)
    awake = -dog.robot[Battery].state.current
    saving = power.save()
    await dog.clock.advance(3.0)
    assert (saving.status, power.mode, legs.posture) == (ActionStatus.SUCCEEDED, PowerMode.LOW_POWER, Posture.LYING)
    assert -dog.robot[Battery].state.current == pytest.approx(0.3 * awake, rel=0.1)
    refused = legs.stand()
    await dog.clock.advance(0.1)
    assert isinstance(refused.error, Refused)
    assert dog.robot[Lidar].scan is not None
    power.wake()
    await dog.clock.advance(2.0)
    assert power.mode is PowerMode.WAKING_UP
    await dog.clock.advance(3.0)
    assert power.mode is PowerMode.AWAKE
    legs.stand()
    await dog.clock.advance(3.0)
    assert legs.posture is Posture.STANDING
    assert [event.mode for event in events.drain()] == ["low power", "waking up", "awake"]


async def test_asleep_the_lidar_stands_still(dog):
    dog.robot[Power].sleep()
    await dog.clock.advance(4.0)
    assert dog.robot[Power].mode is PowerMode.ASLEEP
    assert dog.robot[Lidar].scan is None
    dog.robot[Power].wake()
    await dog.clock.advance(5.0)
    assert dog.robot[Lidar].scan is not None


async def test_low_power_comes_by_itself_if_set(dog):
    power = dog.robot[Power]
    dog.robot[Legs].lie_down()
    await dog.clock.advance(40.0)
    assert power.mode is PowerMode.AWAKE
    await power.set_automatic(True)
    await dog.clock.advance(31.0)
    assert power.mode is PowerMode.LOW_POWER


async def test_off_and_on_again(dog):
    power, events = dog.robot[Power], dog.robot.events.subscribe(ShuttingDown, Rebooted)
    power.shut_down(after=2.0, restart_after=10.0)
    await dog.clock.advance(3.0)
    assert (power.mode, dog.robot[Legs].posture) == (PowerMode.OFF, Posture.LIMP)
    refused = power.wake()
    await dog.clock.advance(0.1)
    assert isinstance(refused.error, Refused)
    await dog.clock.advance(15.0)
    assert power.mode is PowerMode.AWAKE
    down, up = events.drain()
    assert (down.restart_after, down.stamp) == (10.0, pytest.approx(2.0))
    assert up.stamp == pytest.approx(2.0 + 10.0 + 4.0, abs=0.1)


def test_the_disk_fills_up(dog):
    disk, events = dog.robot[Disk], dog.robot.events.subscribe(DiskLow)
    free = disk.free
    disk.take("maps", 1_000_000)
    disk.take("maps", 3_000_000)
    assert disk.free == free - 3_000_000
    assert disk.uses["maps"] == 3_000_000
    disk.take("recordings", disk.free - LOW + 1)
    assert [event.free for event in events.drain()] == [LOW - 1]
    with pytest.raises(Refused):
        disk.take("more", LOW)
    disk.release("recordings")
    assert disk.free == free - 3_000_000


@pytest.mark.slow
async def test_a_download_outlives_a_restart(dog):
    """The record still held it, and so did the disk, but it could not be installed any more."""
    firmware = dog.robot[Firmware]
    await downloaded(dog)
    firmware.reboot()
    await dog.clock.advance(30.0)
    assert (firmware.progress.state, firmware.progress.package) == (FirmwareState.DOWNLOADED, package())
    firmware.install(DIGEST)
    await dog.clock.advance(21.0)
    dog.robot[Power].shut_down(restart_after=1.0)  # any restart runs what was installed
    await dog.clock.advance(30.0)
    assert (firmware.progress.state, firmware.version) == (FirmwareState.IDLE, "2.0")


@pytest.mark.parametrize("way", WAYS)
async def test_a_restart_ends_what_clients_switched(simulate, way):
    """A restart of the robot leaves what a start of this program does."""
    sim = simulate(start=Pose(5, 5), body="universal")
    sim.world.start()
    robot = sim.robot
    at_first = switches(robot)
    robot[EmergencyStop].engage()
    robot[EmergencyStop].release_brake(True)
    robot[EmergencyBraking].enable(not robot[EmergencyBraking].enabled)
    robot[DepthCamera].enable(False)
    robot[ElectronicSkin].show(SkinPattern.LIGHT)
    robot[ElectronicSkin].enable(False)
    robot[Light].shine("eyes")
    assert all(map(ne, at_first, switches(robot)))
    way(robot)
    await sim.clock.advance(40.0)
    assert switches(robot) == at_first


def switches(robot):
    stop, braking, depth = robot[EmergencyStop], robot[EmergencyBraking], robot[DepthCamera]
    skin, eyes = robot[ElectronicSkin].state, robot[Light].state("eyes")
    return [
        stop.engaged, stop.brake_released, braking.enabled, depth.enabled, skin.enabled, skin.pattern, eyes.effect
    ]  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
async def test_every_restart_ends_awake_and_lying(dog, way):
    robot = dog.robot
    robot[Legs].go_limp()
    await dog.clock.advance(1.0)
    asleep = robot[Power].sleep()  # limp legs lie already
    await dog.clock.advance(1.0)
    assert (asleep.status, robot[Power].mode) == (ActionStatus.SUCCEEDED, PowerMode.ASLEEP)
    way(robot)
    await dog.clock.advance(40.0)
    assert (robot[Power].mode, robot[Legs].posture) == (PowerMode.AWAKE, Posture.LYING)
    standing = robot[Legs].stand()
    await dog.clock.advance(4.0)
    assert standing.status is ActionStatus.SUCCEEDED


@pytest.mark.parametrize("installs", [False, True])
async def test_no_reboot_breaks_an_update(dog, installs):
    firmware = dog.robot[Firmware]
    if installs:
        await downloaded(dog)
    updating = firmware.install(DIGEST) if installs else firmware.download(package())
    await dog.clock.advance(5.0)
    with pytest.raises(Busy, match="firmware is under way"):
        firmware.reboot()
    assert not updating.status.ended
