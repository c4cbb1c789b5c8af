"""Actions beyond driving, each through the broker: loads, marks, objects, another try, hibernation, switching off."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.errors import NotFound, Refused
from roboglot.model.geometry import Twist
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.vda5050.chapters.sensing import REPORTS, REPORTS_MAX
from roboglot.protocols.vda5050.context import UNDER_WAY_MAX
from tests.protocols.held_fairness import held
from tests.protocols.vda5050.conftest import ADDRESS, Opened, Yard
from tests.protocols.vda5050.orders import HEADER, action, instant, order

MARKS = str(Path(__file__).parents[2] / "autonomy" / "worlds" / "marks.toml")


def robot_at(x: float, y: float, body: str = "hermes") -> dict[str, object]:
    """Return the one robot of a world with a shelf and a tag, looking east."""
    robot = {"name": "a", "body": body, "address": ADDRESS, "start": {"x": x, "y": y, "yaw": 0.0}}
    return {"world": MARKS, "robots": [robot]}


def here(*actions: dict[str, object], id: str = "here") -> dict[str, object]:
    """Return an order of nothing but actions where the robot stands."""
    made = order(id, [(0, 0)])
    made["nodes"][0]["actions"] = list(actions)
    return made


def states(yard: Yard) -> dict[str, tuple[str, str]]:
    """Status and result of all actions by their ids."""
    state = yard.control.state
    return {
        one["actionId"]: (one["actionStatus"], one.get("actionResult", ""))
        for one in (*state["actionStates"], *state["instantActionStates"])
    }


async def test_a_load_is_picked_reported_and_dropped(yard: Opened) -> None:
    one = await yard(**robot_at(7.5, 6.0))
    assert one.control.state["loads"] == []
    one.control.send(
        "order", here(action("pick", "p", loadId="L1", loadType="shelf"), action("drop", "wrong", lhd="x"))
    )
    await one.until(lambda: states(one).get("wrong", ("", ""))[0] == "FAILED")
    assert states(one)["p"][0] == "FINISHED"
    assert one.robot[Jack].loaded
    assert one.control.state["loads"] == [{"loadId": "L1", "loadType": "shelf", "loadPosition": "jack"}]
    one.control.send("order", here(action("drop", "d", loadId="L1"), action("drop", "again"), id="two"))
    await one.until(lambda: states(one).get("again", ("", ""))[0] == "FAILED")
    assert states(one)["d"][0] == "FINISHED"
    assert one.control.state["loads"] == []
    assert one.control.errors.count("ACTION_FAILED") == 1


async def test_unreported_load_is_left_out_of_states(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a real robot's jack no state was sent at all."""

    def unreported(_: object) -> bool:
        raise Refused("this robot does not report whether its jack is loaded")

    one = await yard(**robot_at(7.5, 6.0))
    monkeypatch.setattr(type(one.robot[Jack]), "loaded", property(unreported))
    one.control.send("order", here(action("pick", "p")))
    await one.until(lambda: states(one).get("p", ("", ""))[0] == "FAILED")
    assert states(one)["p"][1] == "this robot does not report whether its jack is loaded"
    assert "loads" not in one.control.state


@pytest.mark.slow  # in short: test_a_load_is_picked_reported_and_dropped
async def test_load_set_down_by_others_is_forgotten(yard: Opened) -> None:
    one = await yard(**robot_at(7.5, 6.0))
    one.control.send("order", here(action("pick", "p", loadId="L1")))
    await one.until(lambda: states(one).get("p", ("", ""))[0] == "FINISHED")
    for move, loads in (
        (one.robot[Jack].lower_platform, []),
        (one.robot[Jack].raise_platform, [{"loadPosition": "jack"}]),
    ):
        lifting = move(source="other")
        await one.until(lambda: lifting.status is ActionStatus.SUCCEEDED)  # noqa: B023 - at once
        await one.until(lambda: one.control.state["loads"] == loads)  # noqa: B023


async def test_factsheet_follows_limits_and_components(yard: Opened) -> None:
    one = await yard()

    def sheet() -> tuple[float, bool]:
        found = one.control.heard["factsheet"][-1]
        names = {row["actionType"] for row in found["protocolFeatures"]["mobileRobotActions"]}
        return found["physicalParameters"]["maximumSpeed"], "startCharging" in names

    base = one.robot[Base]
    built = base.limits.twist.x
    await one.until(lambda: sheet() == (built, True))
    base.limits = replace(base.limits, twist=Twist(0.25, 0.0, 1.0))  # as another door may
    await one.until(lambda: sheet() == (0.25, True))
    one.robot.withdraw(Docking)  # as a driver that learns that its robot has none
    await one.until(lambda: sheet() == (0.25, False))
    sent = len(one.control.heard["factsheet"])
    await one.clock.advance(2.0)
    one.control.send("instantActions", instant(action("stateRequest", "later")))
    await one.until(lambda: "later" in states(one))
    assert len(one.control.heard["factsheet"]) == sent


async def test_flood_waits_at_the_broker(yard: Opened) -> None:
    one = await yard()
    fairness, heard = held(one.robot), list[Any]()
    leave = one.robot.tap.listen(heard.append)
    fairness.on = True
    for number in range(300):
        one.control.send("instantActions", instant(action("stateRequest", f"s{number}")), wait=False)
    await one.until(lambda: len(fairness.waited) > 3)
    fairness.on = False
    await one.until(lambda: sum(exchange.direction is Direction.REQUEST for exchange in heard) == 300)
    assert set(fairness.waited) == {"vda5050 a:broker"}
    leave()


async def test_message_to_stop_waits_for_no_other_client(yard: Opened) -> None:
    one = await yard()
    fairness = held(one.robot)
    one.control.send("order", order("far", [(0, 0), (9, 0)]))
    await one.until(lambda: one.control.state["driving"])
    fairness.on = True
    one.control.send("instantActions", instant(action("stateRequest", "s")))
    await one.until(lambda: bool(fairness.waited))
    one.control.send("instantActions", instant(action("cancelOrder", "c")))
    await one.until(lambda: states(one).get("c", ("", ""))[0] == "FINISHED")
    assert fairness.on
    assert states(one)["s"][0] == "FINISHED"


async def test_instant_actions_have_either_name(yard: Opened) -> None:
    """Clients made from the schemas of 2.0 and before, such as vda-5050-lib, call the list instantActions."""
    one = await yard("2.1")

    def older(name: str, id: str) -> dict[str, Any]:
        return {**HEADER, "version": "2.0.0", "instantActions": [action(name, id)]}

    one.control.send("order", {**order("far", [(0, 0), (9, 0)]), "version": "2.0.0"})
    await one.until(lambda: one.control.state["driving"])
    fairness = held(one.robot)
    fairness.on = True
    one.control.send("instantActions", older("cancelOrder", "c"))
    await one.until(lambda: "FINISHED" in {state["actionStatus"] for state in one.control.state["actionStates"]})
    fairness.on = False
    one.control.send("instantActions", {**older("stateRequest", "s"), "instantActions": 5})
    await one.until(lambda: bool(one.control.state["errors"]))
    assert one.control.state["errors"][0]["errorDescription"] == "instantActions must be a list, not a whole number"


@pytest.mark.slow
async def test_a_failed_action_waits_to_be_tried_again(yard: Opened) -> None:
    one = await yard(**robot_at(5.0, 5.0))
    made = here(action("pick", "p") | {"retriable": True})
    one.control.send("order", made)
    await one.until(lambda: states(one).get("p", ("", ""))[0] == "RETRIABLE")
    assert "ACTION_FAILED" in one.control.errors, one.control.state["errors"]
    one.control.send("instantActions", instant(action("retry", "r", actionId="p")))
    await one.until(lambda: states(one).get("r", ("", ""))[0] == "FINISHED" and states(one)["p"][0] == "RUNNING")
    assert "ACTION_FAILED" not in one.control.errors, one.control.state["errors"]
    await one.until(lambda: states(one)["p"][0] == "RETRIABLE")
    one.control.send("instantActions", instant(action("skipRetry", "s", actionId="p")))
    await one.until(lambda: states(one)["p"] == ("FAILED", "there is no load over the platform"))
    one.control.send("instantActions", instant(action("retry", "late", actionId="p")))
    await one.until(lambda: states(one).get("late", ("", ""))[0] == "FAILED")
    assert "INVALID_INSTANT_ACTION" in one.control.errors


async def test_instant_actions_under_way_are_limited(yard: Opened) -> None:
    """Each state lists those that wait to be tried again; without a limit it grew until all robots stood."""
    one = await yard()
    waiting = [action("deleteMap", f"w{number}", mapId="no") | {"retriable": True} for number in range(200)]
    for few in (waiting[:50], waiting[50:100], waiting[100:150], waiting[150:]):
        one.control.send("instantActions", instant(*few))
    refused = "FAILED", f"at most {UNDER_WAY_MAX} instant actions are under way"
    await one.until(lambda: states(one).get("w199") == refused)
    assert "INVALID_INSTANT_ACTION" in one.control.errors
    one.control.send("instantActions", instant(action("stateRequest", "s"), action("skipRetry", "r", actionId="w0")))
    await one.until(lambda: states(one).get("r", ("", ""))[0] == "FINISHED")
    assert states(one)["s"][0] == "FINISHED"
    assert sum(status == "RETRIABLE" for status, _ in states(one).values()) == UNDER_WAY_MAX - 1


@pytest.mark.slow
async def test_object_is_found_and_a_mark_driven_to(yard: Opened) -> None:
    one = await yard(**robot_at(7.8, 4.2, "universal"))
    made = here(
        action("detectObject", "tag", objectType="tag"),
        action("detectObject", "person", objectType="person"),
        action("finePositioning", "fine", stationType="printed", stationName="12"),
    )
    one.control.send("order", made)
    await one.until(lambda: states(one).get("fine", ("", ""))[0] in ("FINISHED", "FAILED"), 120)
    assert states(one)["tag"][0] == "FINISHED"
    assert states(one)["tag"][1].startswith("tag 12 at 2.")
    assert states(one)["person"] == ("FAILED", "no person is in sight")
    assert states(one)["fine"][0] == "FINISHED"
    one.control.send("order", here(action("finePositioning", "f", stationType="station"), id="no"))
    await one.until(lambda: "INVALID_ORDER_ACTION" in one.control.errors)


async def test_a_log_report_is_kept_as_a_file(yard: Opened) -> None:
    one = await yard()
    one.control.send("instantActions", instant(action("logReport", "log", reason="it stood still")))
    await one.until(lambda: states(one).get("log", ("", ""))[0] == "FINISHED")
    text = (await one.robot[FileStore].read(states(one)["log"][1])).decode()
    assert "it stood still" in text.splitlines()[0]


async def test_log_report_is_kept_when_old_ones_go(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    one = await yard()
    store = one.robot[FileStore]
    for number in range(REPORTS_MAX):
        await store.write(f"{REPORTS}{number}.txt", b"")

    async def removed_already(name: str) -> None:
        raise NotFound(f"no file {name!r}")

    monkeypatch.setattr(type(store), "remove", lambda _, name: removed_already(name))
    one.control.send("instantActions", instant(action("logReport", "l", reason="why")))
    await one.until(lambda: states(one).get("l", ("",))[0] in ("FINISHED", "FAILED"))
    assert states(one)["l"][0] == "FINISHED"


async def test_hibernation_is_silent_until_it_ends(yard: Opened) -> None:
    one = await yard()
    control = one.control
    control.send("order", order("one", [(0, 0), (3, 0)]))
    await one.until(lambda: control.state["driving"])
    control.send("instantActions", instant(action("startHibernation", "sleep")))
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "HIBERNATING")
    assert states(one)["sleep"][0] == "FINISHED"
    assert (control.state["nodeStates"], control.state["driving"]) == ([], False)
    heard = len(control.heard["state"])
    exchanges: list[Exchange] = []
    leave = one.robot.tap.listen(exchanges.append)
    control.send("order", order("two", [(0, 0), (1, 0)]))
    control.send("instantActions", instant(action("stateRequest", "ignored")))
    await one.clock.advance(40)
    leave()
    control.hear()
    assert len(control.heard["state"]) == heard
    replies = [(one.operation, one.status, one.refusal) for one in exchanges if one.direction is Direction.REPLY]
    asleep = "the robot hibernates"
    assert replies == [("order", "silent", asleep), ("instantActions", "silent", f"{asleep}: stateRequest")]
    control.send("instantActions", instant(action("stopHibernation", "wake")))
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "ONLINE")
    await one.until(lambda: states(one).get("wake", ("", ""))[0] == "FINISHED")
    assert "ignored" not in states(one)
    assert control.state["orderId"] == "one"
    assert one.robot[Power].mode is PowerMode.AWAKE


async def test_actions_of_misspelt_parameters_fail(yard: Opened) -> None:
    """The robot slept for good, without the time at which it should wake up."""
    one = await yard()
    wrong = action("startHibernation", "s", wakeupTime="2026-01-01T00:00:00Z"), action("cancelOrder", "c", order="x")
    one.control.send("instantActions", instant(*wrong))
    await one.until(lambda: [states(one).get(id, ("",))[0] for id in "sc"] == ["FAILED", "FAILED"])
    assert states(one)["s"][1] == "wakeupTime is unknown; did you mean 'wakeUpTime'?"
    assert one.robot[Power].mode is PowerMode.AWAKE


async def test_refused_hibernation_keeps_the_order(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    """A driven dog only saves power by itself, and a driven Slamware robot only sleeps."""
    one = await yard()
    control, power = one.control, one.robot[Power]

    def refuse(_: Power, *, source: str = "") -> Action:
        raise Refused(f"not for {source}")

    monkeypatch.setattr(type(power), "save", refuse)
    monkeypatch.setattr(Power, "rests", raising=False, value=())
    control.send("order", order("one", [(0, 0), (1, 0)]))
    await one.until(lambda: control.state["driving"])
    control.send("instantActions", instant(action("startHibernation", "no")))
    await one.until(lambda: states(one).get("no", ("", ""))[0] == "FAILED")
    await one.until(lambda: not control.state["nodeStates"])
    assert one.robot[Localization].pose.x == pytest.approx(1.0, abs=0.1)
    monkeypatch.setattr(Power, "rests", raising=False, value=(PowerMode.ASLEEP,))
    control.send("instantActions", instant(action("startHibernation", "sleep")))
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "HIBERNATING")
    assert power.mode is PowerMode.ASLEEP


@pytest.mark.slow  # in short: test_hibernation_is_silent_until_it_ends
async def test_wakes_up_by_itself_at_the_set_time(yard: Opened) -> None:
    one = await yard()
    control = one.control
    control.send("instantActions", instant(action("startHibernation", "no", wakeUpTime="yesterday")))
    await one.until(lambda: states(one).get("no", ("", ""))[0] == "FAILED")
    then = one.clock.epoch() + 30
    text = datetime.fromtimestamp(then, UTC).isoformat()
    control.send("instantActions", instant(action("startHibernation", "sleep", wakeUpTime=text)))
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "HIBERNATING")
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "ONLINE")
    assert one.clock.epoch() >= then
    assert states(one)["sleep"][0] == "FINISHED"


@pytest.mark.slow
async def test_earlier_wake_up_time_wakes_no_later_sleep(yard: Opened) -> None:
    one = await yard()
    control = one.control

    def connection() -> str:
        return str(control.heard["connection"][-1]["connectionState"])

    text = datetime.fromtimestamp(one.clock.epoch() + 30, UTC).isoformat()
    control.send("instantActions", instant(action("startHibernation", "nap", wakeUpTime=text)))
    await one.until(lambda: connection() == "HIBERNATING")
    control.send("instantActions", instant(action("stopHibernation", "wake")))
    await one.until(lambda: connection() == "ONLINE")
    control.send("instantActions", instant(action("startHibernation", "sleep")))
    await one.until(lambda: connection() == "HIBERNATING")
    await one.clock.advance(40)
    control.hear()
    assert connection() == "HIBERNATING"


@pytest.mark.slow  # in short: test_hibernation_is_silent_until_it_ends
async def test_hibernation_ends_when_others_wake_the_robot(yard: Opened) -> None:
    one = await yard()
    control = one.control
    for number, wake in enumerate((lambda: one.robot[Power].wake(), lambda: one.robot[Firmware].reboot())):
        then = datetime.fromtimestamp(one.clock.epoch() + 60, UTC).isoformat()
        control.send("instantActions", instant(action("startHibernation", f"sleep {number}", wakeUpTime=then)))
        await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "HIBERNATING")
        wake()
        await one.until(lambda: one.robot[Power].mode is PowerMode.AWAKE)
        await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "ONLINE")
    one.robot[Power].sleep()
    await one.clock.advance(80)  # the set time has passed
    assert one.robot[Power].mode is PowerMode.ASLEEP


async def test_a_robot_that_is_switched_off_takes_leave(yard: Opened) -> None:
    one = await yard()
    control = one.control
    control.send("order", order("one", [(0, 0), (3, 0)]))
    await one.until(lambda: control.state["driving"])
    control.send("instantActions", instant(action("shutdown", "early")))
    await one.until(lambda: states(one).get("early", ("", ""))[0] == "FAILED")
    control.send("instantActions", instant(action("cancelOrder", "c")))
    await one.until(lambda: states(one).get("c", ("", ""))[0] == "FINISHED")
    control.send("instantActions", instant(action("shutdown", "off")))
    await one.until(lambda: control.heard["connection"][-1]["connectionState"] == "OFFLINE")
    assert states(one)["off"][0] == "FINISHED"
    assert one.robot[Power].mode is PowerMode.OFF


async def test_zones_are_refused_aloud(yard: Opened) -> None:
    one = await yard()
    one.control.send("zoneSet", {"zoneSet": {"mapId": "map", "zoneSetId": "z", "zones": []}})
    await one.until(lambda: one.control.errors == ["UNSUPPORTED_PARAMETER"])
    one.control.send("order", order("one", [(0, 0)]) | {"zoneSetId": "z"})
    await one.until(lambda: len(one.control.errors) == 2)
    assert one.control.state["orderId"] == ""
    assert one.control.heard["factsheet"][0]["typeSpecification"]["supportedZones"] == []


async def test_robot_that_goes_down_takes_no_order(yard: Opened) -> None:
    one = await yard()
    one.robot.starts.down = "the robot restarts"
    one.control.send("order", order("far", [(0, 0), (9, 0)]))
    await one.until(lambda: bool(one.control.errors))
    assert not one.robot.actions.running()
    assert one.control.state["orderId"] == ""
