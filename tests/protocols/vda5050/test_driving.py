"""Orders are driven truthfully: what the state says is what the robot did, by mosquitto and a foreign client."""

from __future__ import annotations

import math
from typing import Any

import pytest

from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import PERSON, Lease
from roboglot.model.geometry import Twist
from roboglot.protocols.vda5050 import vocabulary
from roboglot.protocols.vda5050.server import Vda5050Door
from roboglot.wire.vda5050.orders import NODES_MAX
from tests.protocols.vda5050.conftest import Opened, Yard
from tests.protocols.vda5050.orders import action, instant, order


def status(yard: Yard, id: str) -> str:
    listed = [*yard.control.state["actionStates"], *yard.control.state.get("instantActionStates", [])]
    return next((state["actionStatus"] for state in listed if state["actionId"] == id), "")


def distance(yard: Yard, x: float, y: float) -> float:
    pose = yard.robot[Localization].pose
    return math.hypot(pose.x - x, pose.y - y)


async def test_an_order_is_driven_node_by_node(yard: Opened) -> None:
    one = await yard()
    made = order("one", [(0, 0), (1, 0), (1.5, 0.5)])
    one.control.send("order", made)
    await one.until(lambda: one.control.state["driving"])
    assert one.control.state["nodeStates"]
    await one.until(lambda: one.control.state["lastNodeId"] == "n2")
    assert distance(one, 1.5, 0.5) < 0.15
    await one.until(lambda: not one.control.state["driving"])
    state = one.control.state
    assert (state["orderId"], state["nodeStates"], state["edgeStates"], state["errors"]) == ("one", [], [], [])
    seen = [state["lastNodeSequenceId"] for state in one.control.heard["state"] if state["orderId"] == "one"]
    assert seen == sorted(seen)
    assert set(seen) >= {0, 2, 4}
    for said in one.control.heard["state"]:  # the rest continues the passed part
        assert all(node["sequenceId"] > said["lastNodeSequenceId"] for node in said["nodeStates"])


async def test_an_order_of_most_nodes_is_driven(yard: Opened) -> None:
    """The robot's navigation takes fewer goals at once than an order may have nodes."""
    one = await yard()
    one.control.send("order", order("long", [(0.0, 0.0)] * NODES_MAX))
    await one.until(lambda: one.control.state["orderId"] == "long" and not one.control.state["nodeStates"])
    assert one.control.state["lastNodeId"] == f"n{NODES_MAX - 1}"
    assert one.control.errors == []


async def test_a_retained_order_is_refused(yard: Opened) -> None:
    """The broker sends it again at each connection, long after fleet control meant it."""
    first = await yard()
    await first.close()
    first.control.send("order", order("kept", [(0, 0), (1, 0)]), retain=True)
    one = await yard()
    await one.until(lambda: "VALIDATION_FAILURE" in one.control.errors)
    assert one.control.state["orderId"] == ""
    one.control.send("order", order("new", [(0, 0)]))
    await one.until(lambda: one.control.state["orderId"] == "new")


async def test_robot_waits_at_the_decision_point_for_more(yard: Opened) -> None:
    one = await yard()
    one.control.send("order", order("one", [(0, 0), (0.6, 0), (1.2, 0)], released=2))
    await one.until(lambda: one.control.state["lastNodeId"] == "n1" and not one.control.state["driving"])
    assert one.control.state["newBaseRequest"] is False or one.control.state["nodeStates"]
    assert [node["released"] for node in one.control.state["nodeStates"]] == [False]
    one.control.send("order", order("one", [(0.6, 0), (1.2, 0)], update=1, first=1))
    await one.until(lambda: one.control.state["lastNodeId"] == "n2")
    assert distance(one, 1.2, 0) < 0.15


async def test_actions_hold_the_robot_until_they_end(yard: Opened) -> None:
    one = await yard()
    made = order("one", [(0, 0), (0.5, 0), (1, 0)])
    made["nodes"][1]["actions"] = [action("waitForTrigger", "w", "HARD")]
    one.control.send("order", made)
    await one.until(lambda: status(one, "w") == "RUNNING" and not one.control.state["driving"])
    await one.clock.advance(5)
    assert distance(one, 0.5, 0) < 0.15
    one.control.send("instantActions", instant(action("trigger", "t", "NONE")))
    await one.until(lambda: one.control.state["lastNodeId"] == "n2")
    assert status(one, "w") == "FINISHED"
    assert status(one, "t") == "FINISHED"


async def test_pause_holds_and_cancel_ends(yard: Opened) -> None:
    one = await yard()
    one.control.send("order", order("one", [(0, 0), (3, 0)]))
    await one.until(lambda: one.control.state["driving"])
    one.control.send("instantActions", instant(action("startPause", "p", "NONE")))
    await one.until(lambda: one.control.state["paused"] and not one.control.state["driving"])
    held = one.robot[Localization].pose
    await one.clock.advance(3)
    assert distance(one, held.x, held.y) < 0.05
    one.control.send("instantActions", instant(action("stopPause", "q", "NONE")))
    await one.until(lambda: one.control.state["driving"])
    one.control.send("instantActions", instant(action("cancelOrder", "c", "NONE")))
    await one.until(lambda: status(one, "c") == "FINISHED" and not one.control.state["driving"])
    assert one.control.state["nodeStates"] == []
    assert one.control.state["orderId"] == "one"
    assert distance(one, 3, 0) > 0.5
    one.control.send("instantActions", instant(action("cancelOrder", "d", "NONE")))
    await one.until(lambda: status(one, "d") == "FAILED")
    assert "NO_ORDER_TO_CANCEL" in one.control.errors


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda o: o["nodes"][1]["nodePosition"].update(mapId="moon"), "UNKNOWN_MAP_ID"),
        (lambda o: o["nodes"][1].pop("nodePosition"), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["nodes"][1].update(actions=[action("wave", "1")]), "INVALID_ORDER_ACTION"),
        (lambda o: o["edges"][0].update(actions=[action("beep", "1")]), "INVALID_ORDER_ACTION"),
        (lambda o: o["edges"][0].update(trajectory={"degree": 1}), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["edges"][0].update(maximumHeight=0.01), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["edges"][0].update(maximumMobileRobotHeight=0.01), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["edges"][0].update(minimumLoadHandlingDeviceHeight=0.1), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["edges"][0].update(maximumRotationSpeed=0.01), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["edges"][0].update(maxRotationSpeed=0.01), "UNSUPPORTED_PARAMETER"),
        (lambda o: o["nodes"][0]["nodePosition"].update(x=9.0), "START_NODE_OUT_OF_RANGE"),
        (lambda o: o.pop("nodes"), "VALIDATION_FAILURE"),
        (lambda o: o.update(version="2.1.0"), "VALIDATION_FAILURE"),
    ],
)
async def test_impossible_orders_are_refused_in_standard_words(yard: Opened, change: Any, error: str) -> None:
    one = await yard()
    made = order("bad", [(0, 0), (1, 0)])
    change(made)
    one.control.send("order", made)
    await one.until(lambda: one.control.errors == [error])
    assert one.control.state["orderId"] == ""
    one.control.send("order", order("good", [(0, 0)]))
    await one.until(lambda: one.control.state["orderId"] == "good")
    assert one.control.errors == []


async def test_order_that_cannot_continue_reports_it_and_stays(yard: Opened) -> None:
    one = await yard()
    one.control.send("order", order("one", [(0, 0), (3, 0)]))
    await one.until(lambda: one.control.state["driving"])
    one.robot[EmergencyStop].engage()
    await one.until(lambda: one.control.state["safetyState"]["activeEmergencyStop"] == "MANUAL")
    await one.until(lambda: not one.control.state["driving"] and bool(one.control.errors))
    assert one.control.state["nodeStates"]
    assert one.control.state["errors"][0]["errorLevel"] == "CRITICAL"


async def test_another_client_is_seen_and_control_is_respected(yard: Opened) -> None:
    one = await yard()
    moved = one.robot[Driving].drive(Twist(0.1, 0, 0), source="somewhere else")
    await one.until(lambda: one.control.state["operatingMode"] == "MANUAL")
    moved.cancel()
    await one.until(lambda: one.control.state["operatingMode"] == "AUTOMATIC")
    stood = one.robot[Localization].pose
    await one.robot[Lease].take(PERSON)
    one.control.send("order", order("one", [(0, 0), (1, 0)]))
    await one.until(
        lambda: any(
            "control is taken" in e["errorDescription"]
            for e in one.control.state["errors"]
            if e["errorLevel"] == "CRITICAL"
        )
    )
    await one.clock.advance(3)
    assert distance(one, stood.x, stood.y) < 0.05


async def test_robot_is_localized_from_its_first_scan_on(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    scanned = False
    monkeypatch.setattr(LidarLocalization, "started", property(lambda _: scanned))
    one = await yard()
    await one.until(lambda: one.control.state["mobileRobotPosition"]["localized"] is False)
    scanned = True
    await one.until(lambda: one.control.state["mobileRobotPosition"]["localized"] is True, seconds=2.0)  # not the 30


async def test_version_2_1_has_its_own_words(yard: Opened) -> None:
    one = await yard("2.1")
    one.control.send("instantActions", instant(action("cancelOrder", "c", "NONE"), version="2.1.0"))
    await one.until(lambda: status(one, "c") == "FAILED")
    state = one.control.state
    assert state["errors"][0]["errorType"] == "noOrderToCancel"
    assert {"agvPosition", "batteryState"} <= state.keys()
    assert "instantActionStates" not in state
    assert state["agvPosition"]["positionInitialized"] is True
    assert one.control.heard["factsheet"][0]["typeSpecification"]["agvClass"] == "CARRIER"


async def test_the_broker_says_when_the_robot_is_gone(yard: Opened) -> None:
    one = await yard()
    assert one.control.heard["connection"][-1]["connectionState"] == "ONLINE"
    await one.until(lambda: "visualization" in one.control.heard)
    assert {"x", "y", "theta", "mapId", "localized"} <= one.control.heard["visualization"][-1][
        "mobileRobotPosition"
    ].keys()
    assert 0.0 < one.control.heard["visualization"][-1]["mobileRobotPosition"]["deviationRange"] < 0.1  # m
    await one.close()
    await one.until(lambda: one.control.heard["connection"][-1]["connectionState"] == "OFFLINE", 0)


async def test_a_message_that_breaks_the_door_ends_nothing(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    one = await yard()
    (door,) = one.runtime.doors["a"]._doors
    assert isinstance(door, Vda5050Door)

    def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    with monkeypatch.context() as patch:
        patch.setattr(door._context, "check", broken)
        one.control.send("order", order("one", [(0, 0), (0.5, 0)]))
        await one.until(lambda: any("internal error" in e["errorDescription"] for e in one.control.state["errors"]))
    one.control.send("order", order("two", [(0, 0), (0.5, 0)]))
    await one.until(lambda: one.control.state["lastNodeId"] == "n1")


async def test_failed_state_does_not_end_later_ones(
    yard: Opened, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    one = await yard()

    def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    with monkeypatch.context() as patch:
        patch.setattr(vocabulary, "velocity", broken)
        await one.clock.advance(3)
    assert caplog.text.count("sending state to fleet control crashed") == 1
    assert caplog.text.count("sending visualization to fleet control crashed") == 1
    one.control.send("order", order("one", [(0, 0), (0.5, 0)]))
    await one.until(lambda: one.control.state["lastNodeId"] == "n1")
    heard = len(one.control.heard["visualization"])
    await one.until(lambda: len(one.control.heard["visualization"]) > heard)


async def test_an_order_whose_driving_breaks_is_reported(yard: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    one = await yard()

    def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr("roboglot.protocols.vda5050.context.Context.speed_ratio", broken)
    one.control.send("order", order("one", [(0, 0), (0.5, 0)]))
    await one.until(lambda: one.control.errors == ["NODE_UNREACHABLE"])
    assert one.control.state["errors"][0]["errorLevel"] == "CRITICAL"


async def test_unpausable_motion_fails_the_pause(yard: Opened) -> None:
    """A robot whose skill cannot be paused drove on, reported as paused."""
    one = await yard()
    one.control.send("order", order("one", [(0, 0), (3, 0)]))
    await one.until(lambda: one.control.state["driving"])
    (driving,) = one.robot.actions.running(BASE)
    driving.pausable = False
    one.control.send("instantActions", instant(action("startPause", "p", "NONE")))
    await one.until(lambda: status(one, "p") == "FAILED")
    assert one.control.state["paused"] is False
    driving.cancel()
    await one.until(lambda: not one.control.state["driving"])


@pytest.mark.slow  # in short: test_pause_holds_and_cancel_ends
async def test_pause_holds_driving_actions_too(yard: Opened) -> None:
    one = await yard()
    made = order("one", [(0, 0), (2, 0)])
    made["nodes"][1]["actions"] = [action("startCharging", "dock", "HARD")]
    one.control.send("order", made)
    await one.until(lambda: status(one, "dock") == "RUNNING" and one.control.state["driving"])
    one.control.send("instantActions", instant(action("startPause", "p", "NONE")))
    await one.until(lambda: one.control.state["paused"] and not one.control.state["driving"], seconds=5.0)
    held = one.robot[Localization].pose
    await one.clock.advance(5)
    assert distance(one, held.x, held.y) < 0.05
    assert status(one, "dock") == "PAUSED"
    one.control.send("instantActions", instant(action("stopPause", "q", "NONE")))
    await one.until(lambda: status(one, "dock") == "FINISHED")
    assert one.control.state["powerSupply"]["charging"] is True


async def test_cancelled_docking_stands_when_cancel_finishes(yard: Opened) -> None:
    one = await yard()
    made = order("one", [(0, 0), (2, 0)])
    made["nodes"][1]["actions"] = [action("startCharging", "dock", "HARD")]
    one.control.send("order", made)
    await one.until(lambda: status(one, "dock") == "RUNNING" and one.robot[Odometry].reading.twist.x > 0.3)
    one.control.send("instantActions", instant(action("cancelOrder", "c", "NONE")))
    await one.until(lambda: status(one, "c") == "FINISHED")
    first = next(state for state in one.control.heard["state"] if "FINISHED" in str(state["instantActionStates"]))
    assert first["driving"] is False
