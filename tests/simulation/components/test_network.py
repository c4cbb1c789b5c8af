"""Wi-Fi networks of the world, joining and leaving them, an access point of one's own, the modem, what is kept."""

import asyncio

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.network import (
    MobileState,
    Network,
    NetworkMode,
    NetworkState,
    Uplink,
)
from roboglot.model.errors import ComponentMissing, InvalidGoal, NotFound, Refused
from roboglot.model.events import NetworkChanged
from roboglot.model.geometry import Pose

OFFICE = "roboglot"
GUESTS = "office-guests"


@pytest.mark.world("office")
async def test_new_robot_is_in_its_intended_network(robot, forward):
    await forward(seconds=1)
    state = robot[Network].state
    assert (state.mode, state.ssid, state.internet, state.route) == (NetworkMode.STATION, OFFICE, True, Uplink.WIFI)
    assert state.address == "10.6.128.100"
    assert state.gateway == "10.6.128.1"
    assert state.mac.startswith("02:00:5e:")
    assert len(state.mac) == 17


@pytest.mark.world("office", robots=("a", "b"))
async def test_every_card_has_its_own_addresses(fleet, forward):
    await forward(seconds=1)
    a, b = (fleet.robots[name][Network].state for name in "ab")
    assert a.mac != b.mac
    assert {a.address, b.address} == {"10.6.128.100", "10.6.128.101"}


@pytest.mark.world("office")
async def test_scans_hear_every_network_by_distance(robot, world, forward):
    world.stage.place("a", Pose(21.0, 5.0))
    await forward(seconds=1)
    heard = robot[Network].networks
    assert [(network.ssid, network.secured) for network in heard] == [(GUESTS, False), (OFFICE, True)]
    assert heard[0].signal > heard[1].signal + 6


@pytest.mark.world("office")
async def test_joining_takes_a_while_and_is_kept(robot, forward):
    await forward(seconds=1)
    events = robot.events.subscribe(NetworkChanged)
    action = robot[Network].join(GUESTS)
    await forward(seconds=1.5)
    assert robot[Network].state.address == ""
    assert not robot[Network].connected
    await forward(seconds=3)
    assert action.status is ActionStatus.SUCCEEDED
    assert (robot[Network].state.ssid, robot[Network].state.address) == (GUESTS, "172.16.4.100")
    assert tuple(robot[Network].known) == (GUESTS, OFFICE)
    assert [event.state.ssid for event in events.drain()] == ["", GUESTS]
    await robot[Network].forget(GUESTS)
    await forward(seconds=1)
    assert robot[Network].state.ssid == OFFICE


@pytest.mark.world("office")
@pytest.mark.parametrize(("ssid", "password", "error"), [(OFFICE, "wrong-key", Refused), ("nowhere", "", NotFound)])
async def test_a_network_that_lets_no_one_in(robot, forward, ssid, password, error):
    await forward(seconds=1)
    action = robot[Network].join(ssid, password)
    await forward(seconds=4)
    assert isinstance(action.error, error)
    await forward(seconds=1)
    assert robot[Network].state.ssid == OFFICE


async def test_impossible_names_and_keys_are_refused_at_once(robot):
    for ssid, password in (("", ""), ("x" * 33, ""), ("x", "short"), ("x", "y" * 64)):
        with pytest.raises(InvalidGoal):
            robot[Network].join(ssid, password)
        with pytest.raises(InvalidGoal):
            await robot[Network].be_access_point(ssid, password)


@pytest.mark.world("office", body="hermes")
async def test_as_access_point_modem_is_the_way_out(robot, forward):
    await robot[Network].be_access_point()
    await forward(seconds=1)
    state = robot[Network].state
    assert state.mode is NetworkMode.ACCESS_POINT
    assert state.ssid.startswith("Slamware-")
    assert (state.address, state.wired) == ("192.168.11.1", "192.168.11.1/24")
    assert (state.internet, state.route) == (True, Uplink.MOBILE)
    assert not robot[Network].connected
    assert "network lost" not in [fault.name for fault in robot[Health].faults]
    await robot[Network].set_apn("nonsense")
    assert robot[Network].mobile == MobileState("nonsense", -85.0, False)
    assert not robot[Network].state.internet
    await robot[Network].be_station()
    await forward(seconds=1)
    assert robot[Network].state.ssid == OFFICE


@pytest.mark.world("office", body="hermes")
async def test_the_way_out_follows_the_priority(robot, forward):
    await forward(seconds=1)
    assert robot[Network].state.route is Uplink.WIFI
    await robot[Network].set_priority(Uplink.MOBILE)
    assert robot[Network].state.route is Uplink.MOBILE


@pytest.mark.world("office", body="hermes")
async def test_changes_at_once_are_all_kept(robot, slow_settings):
    network = robot[Network]
    await asyncio.gather(network.set_apn("cmnet"), network.set_priority(Uplink.MOBILE), network.set_dhcp(False))
    assert network.mobile.apn == "cmnet"
    assert (network.state.route, network.state.dhcp) == (Uplink.MOBILE, False)


@pytest.mark.world("office", body="cyberdog2")
async def test_no_modem_no_mobile_network(robot, world, forward):
    assert robot[Network].mobile is None
    for setting in (robot[Network].set_apn("cmnet"), robot[Network].set_priority(Uplink.MOBILE)):
        with pytest.raises(ComponentMissing):
            await setting
    world.faults.inject("wifi_loss", "a")
    await forward(seconds=2)
    state: NetworkState = robot[Network].state
    assert (state.ssid, state.address, state.internet, state.route) == ("", "", False, None)
    assert robot[Network].networks == ()
    download = robot[Firmware].download(robot[Firmware].available)
    await forward(seconds=3)
    assert download.status is ActionStatus.ABORTED


@pytest.mark.world("office")
async def test_a_kept_address_fits_its_own_network_only(robot, forward):
    await forward(seconds=1)
    await robot[Network].set_dhcp(False)
    robot[Network].join(GUESTS)
    await forward(seconds=5)
    state = robot[Network].state
    assert (state.dhcp, state.ssid, state.address, state.route) == (False, GUESTS, "10.6.128.100", Uplink.MOBILE)
    await robot[Network].set_dhcp(True)
    assert robot[Network].state.address == "172.16.4.100"


@pytest.mark.world("office")
async def test_switched_off_it_hears_nothing(robot, forward):
    await robot[Network].switch_off()
    await forward(seconds=1)
    assert robot[Network].state.mode is NetworkMode.OFF
    assert robot[Network].networks == ()
    assert not robot[Network].connected
