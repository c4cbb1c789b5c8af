"""The action list: states, names, gravestones, the last 20."""

import asyncio

import httpx

from roboglot.model.actions import Action
from roboglot.model.components.motion.driving import BASE
from roboglot.model.errors import Unreachable
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters import motion as wire

ACTIONS = "/api/core/motion/v1/actions"


# The fields that the manual's schemas give to options of actions.
OPTIONS = {
    wire.MoveOptions: "mode flags yaw acceptable_precision fail_retry_count speed_ratio",
    wire.GoHome: "flags back_to_landing charging_retry_count move_options",
    wire.RecoverLocalizationOptions: "area relocalization_options",
    wire.RelocalizationOptions: "max_recover_time recover_movement_type",
    wire.MoveToTagOptions: "target tag_type target_relative_pose backward_docking turn_radian tag_ids reflect_tag_num"
    " dock_retry_count dock_allowance",
    wire.BackOffFromTagOptions: "backup_mode tag_type backup_distance backward_docking",
    wire.EnterElevatorOptions: "elevator_id enter_elevator_options",
    wire.EnterElevator: "elevator_door_flag elevator_stopping_yaw timeout_in_ms use_conservative_mode",
    wire.LeaveElevatorOptions: "elevator_id target leave_elevator_options",
    wire.LeaveElevator: "elevator_door_flag timeout_in_ms arrive_door_timeout_in_ms search_path_timeout_in_ms"
    " on_elevator_door_timeout_in_ms if_need_reach_milestone move_options",
}


def test_no_option_of_the_manual_is_unread() -> None:
    missing = [
        f"{options.__name__}.{name}"
        for options, names in OPTIONS.items()
        for name in names.split()
        if name not in options.__struct_fields__
    ]
    assert not missing


async def for_ever(_: Action) -> None:
    await asyncio.Event().wait()


async def at_once(_: Action) -> None:
    return


async def test_a_life(bare: Robot, bare_client: httpx.AsyncClient, forward: Forward) -> None:
    action = bare.actions.start("navigate", for_ever, resources={BASE}, pausable=True)
    await forward(seconds=1)
    current = (await bare_client.get(f"{ACTIONS}/:current")).json()
    assert current == {
        "action_id": action.id,
        "action_name": "slamtec.agent.actions.MoveToAction",
        "stage": "",
        "state": {"status": 1, "result": 0, "reason": ""},
    }
    assert (await bare_client.get(f"{ACTIONS}/{action.id}")).json() == current
    action.pause()
    assert (await bare_client.get(f"{ACTIONS}/:current")).json()["state"]["status"] == 3
    action.resume()
    assert (await bare_client.delete(f"{ACTIONS}/:current")).status_code == 200
    await forward(seconds=0)
    assert (await bare_client.get(f"{ACTIONS}/:current")).status_code == 404
    grave = (await bare_client.get(f"{ACTIONS}/{action.id}")).json()
    assert set(grave) == {"action_id", "state"}
    assert (grave["state"]["status"], grave["state"]["result"]) == (4, -2)
    assert grave["state"]["reason"]


async def test_success_has_no_reason_and_failure_has_one(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward
) -> None:
    async def fail(_: Action) -> None:
        raise Unreachable("a wall")

    good = bare.actions.start("navigate", at_once, resources={BASE})
    await forward(seconds=0)
    bad = bare.actions.start("navigate", fail, resources={BASE})
    await forward(seconds=0)
    state = (await bare_client.get(f"{ACTIONS}/{good.id}")).json()["state"]
    assert state == {"status": 4, "result": 0, "reason": ""}
    state = (await bare_client.get(f"{ACTIONS}/{bad.id}")).json()["state"]
    assert state == {"status": 4, "result": -1, "reason": "CANNOT_REACH_TARGET"}


async def test_the_last_twenty_can_be_asked_for(bare: Robot, bare_client: httpx.AsyncClient, forward: Forward) -> None:
    ids = []
    for _ in range(25):
        ids.append(bare.actions.start("drive", at_once, resources={BASE}).id)
        await forward(seconds=0)
    found = [(await bare_client.get(f"{ACTIONS}/{id}")).status_code for id in ids]
    assert found == [404] * 5 + [200] * 20


async def test_an_arm_moving_is_not_the_current_action(
    bare: Robot, bare_client: httpx.AsyncClient, forward: Forward
) -> None:
    arm = bare.actions.start("reach", for_ever, resources={"arm"})
    await forward(seconds=0)
    assert (await bare_client.get(f"{ACTIONS}/:current")).status_code == 404
    await bare_client.delete(f"{ACTIONS}/:current")
    await forward(seconds=0)
    assert not arm.status.ended
    arm.cancel()
