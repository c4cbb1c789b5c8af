"""Every operation of the contract, once, through the client against our own door."""

import re
from typing import Any

import pytest

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.protocols.slamware import dispatch
from roboglot.protocols.slamware.table import TABLE
from roboglot.testing import Forward
from roboglot.wire.contracts import contract
from roboglot.wire.slamware.chapters import artifact, delivery, industry, motion, multi_floor
from roboglot.wire.slamware.chapters.slam.localization import NewOrigin, Registration, Switch
from roboglot.wire.slamware.chapters.system import devices, network
from roboglot.wire.slamware.geometry import Point, Pose2D, Pose3D

ON = Switch(True)
PLACE = artifact.PoseEntry("4b8a7f2c-1f6e-4c43-8a5e-9b3d2f1c0a77", Pose2D(1.0, 0.5, 0.3), {"display_name": "101"})
DOCK = artifact.PoseEntry("0d0c0000-1f6e-4c43-8a5e-9b3d2f1c0a77", Pose2D(0.0, 0.0, 0.0), {"display_name": "dock"})
MOVED = artifact.PoseChange(Pose3D(1.1, 0.5, 0.0, 0.3))
WALLS, FORBIDDEN = artifact.LineUsage.WALLS, artifact.AreaUsage.FORBIDDEN
LINES = [artifact.Line(Point(3.0, 3.0), Point(4.0, 3.0), 1)]
AREA = artifact.Strip(Point(3.0, 3.0), Point(4.0, 3.0), 0.5)
LIGHT = devices.LightControl(
    devices.Channel.ONE, devices.Half.LEFT, devices.Mode.BLINK, devices.LightColour(255), bright_ms=500, off_ms=500
)
ORDER = delivery.TaskRequest(delivery.Destination("101"), "GUIDE")

# Arguments of each operation that takes any.
VALUES: dict[str, dict[str, Any]] = {
    "shutdown": {"body": devices.Shutdown(60)},
    "restart_module": {"body": devices.Restart(devices.RestartMode.SOFT)},
    "clear_robot_health": {"error_code": 1},
    "get_system_parameter": {"param": "base.max_moving_speed"},
    "set_system_parameter": {"body": devices.Parameter("base.max_moving_speed", "0.5")},
    "set_network_status": {"body": network.NetworkRequest(network.RequestedMode.DHCP)},
    "set_network_route": {"body": network.RouteStatus("wifi")},
    "set_cmlink_apn": {"body": network.ApnStatus("cmhk")},
    "set_cube_config": {"body": b"cube"},
    "set_light_control": {"body": LIGHT},
    "set_aeb_control": {"body": "On"},
    "set_jack_req": {"body": "Stop"},
    "set_pose": {"body": Pose3D(0.0, 0.0)},
    "set_map_localization": {"body": ON},
    "set_map_update": {"body": ON},
    "set_loop_closure": {"body": ON},
    "set_home_pose": {"body": Pose3D(0.0, 0.0)},
    "set_home_docks": {"body": [DOCK]},
    "add_home_dock": {"body": DOCK},
    "register_home_dock": {"body": Registration({"display_name": "new"})},
    "edit_home_dock": {"dock_id": DOCK.id, "body": MOVED},
    "erase_home_dock": {"dock_id": DOCK.id},
    "move_origin_point": {"body": NewOrigin(Point(0.0, 0.0))},
    "get_lines": {"usage": WALLS},
    "add_lines": {"usage": WALLS, "body": LINES},
    "modify_lines": {"usage": WALLS, "body": LINES},
    "clear_lines": {"usage": WALLS},
    "remove_line_by_id": {"usage": WALLS, "id": 1},
    "get_rectangle_areas": {"usage": FORBIDDEN},
    "add_rectangle_area": {"usage": FORBIDDEN, "body": artifact.AreaRequest(AREA)},
    "clear_rectangle_areas": {"usage": FORBIDDEN},
    "edit_rectangle_area": {"usage": FORBIDDEN, "id": 1, "body": artifact.AreaChange(AREA)},
    "remove_rectangle_area_by_id": {"usage": FORBIDDEN, "id": 1},
    "add_pois": {"body": PLACE},
    "get_poi_by_id": {"poi_id": PLACE.id},
    "modify_poi": {"poi_id": PLACE.id, "body": MOVED},
    "delete_poi": {"poi_id": PLACE.id},
    "put_laser_landmarks": {"body": [PLACE]},
    "set_laser_landmark_update": {"body": ON},
    "remove_laser_landmarks": {"body": [PLACE.id]},
    "create_action": {
        "body": motion.ActionRequest("slamtec.agent.actions.MoveByAction", {"direction": 0, "duration": 100})
    },
    "get_action_result": {"action_id": 1},
    "search_path": {"body": motion.PathQuery(Point(0.5, 0.0))},
    "set_current_strategy": {"body": motion.Strategy("default")},
    "set_enable_auto_update": {"body": ON},
    "upload_and_start_update": {"body": b"package"},
    "set_depth_sensor_state": {"body": ON},
    "set_sensor_mask": {"body": [devices.SensorSwitch(1, True)]},
    "install_app": {"body": b"package"},
    "delete_app": {"app_name": "none"},
    "set_current_floor": {"body": multi_floor.FloorChoice("")},
    "dispatch_by_pois": {"body": ["101"]},
    "set_current_home_dock": {"body": multi_floor.DockChoice(DOCK.id)},
    "search_path_points_in_graph": {"body": multi_floor.TrackQuery(Point(1.0, 0.0))},
    "set_pose_by_poi": {"body": multi_floor.PoiChoice("101")},
    "set_pose_by_homedock": {"body": multi_floor.DockChoice(DOCK.id)},
    "get_elevators_by_id": {"elevator_id": "1"},
    "get_pose_relation_to_elevator": {"elevator_id": "1"},
    "create_task_template": {"body": industry.TemplateRequest("round", [industry.TaskOperation("101")], "key-1")},
    "delete_task_template": {"key_id": "key-1"},
    "get_industry_tasks": {"type": "industry"},
    "post_task_event": {"body": industry.TaskEvent("none", "RUNNING")},
    "set_password": {"body": delivery.Password(True, "1234")},
    "set_work_mode": {"body": delivery.WorkModeEntry("DISPATCH")},
    "set_language": {"body": delivery.Language("en")},
    "set_working_time": {"body": delivery.WorkingTime([delivery.Hours("08:00:00", "20:00:00")])},
    "set_move_options": {"body": {"mode": 0}},
    "set_line_speed": {"body": delivery.LineSpeed(0.5, 0.5)},
    "set_timeout_settings": {"body": delivery.TimeoutChange(60)},
    "get_cargo_boxes": {"cargo_id": "1"},
    "get_cargo_box": {"cargo_id": "1", "box_id": 1},
    "operate_box": {"cargo_id": "1", "box_id": 1, "op": ":open"},
    "get_operation_result": {"cargo_id": "1", "box_id": 1},
    "create_task": {"body": ORDER},
    "create_tasks": {"body": [ORDER]},
    "cancel_task_by_task_id": {"task_id": "none"},
    "cancel_task_by_order_id": {"order_id": "none"},
    "set_task_execution": {"body": delivery.TaskExecution(True)},
}


def method_of(name: str) -> str:
    """getImuRawADCData -> get_imu_raw_adc_data."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def test_client_has_a_method_per_operation_key() -> None:
    for row in contract("slamware"):
        assert getattr(SlamwareClient, method_of(row.name)).key == row.key


# Calls made first, to create what the operation needs.
BEFORE: dict[str, tuple[str, ...]] = {
    "edit_home_dock": ("add_home_dock",),
    "erase_home_dock": ("add_home_dock",),
    "remove_line_by_id": ("add_lines",),
    "edit_rectangle_area": ("add_rectangle_area",),
    "remove_rectangle_area_by_id": ("add_rectangle_area",),
    "get_poi_by_id": ("add_pois",),
    "modify_poi": ("add_pois",),
    "delete_poi": ("add_pois",),
    "remove_laser_landmarks": ("put_laser_landmarks",),
    "get_current_action": ("create_action",),
    "create_task_template": ("add_pois",),
    "create_task": ("add_pois",),
}

# Source of the id of what was created before.
LISTED = {
    "remove_line_by_id": "get_lines",
    "edit_rectangle_area": "get_rectangle_areas",
    "remove_rectangle_area_by_id": "get_rectangle_areas",
}
UNDECIDED = {"upload_and_start_update", "install_app"}  # a bad package is refused at once or when unpacked

# Refusals of this robot in its state here, with the status; all others must succeed.
REFUSED = {
    "clear_robot_health": 400,  # it has no fault
    "set_cube_config": 400,
    "delete_app": 404,  # it has none
    "set_current_floor": 404,  # its map was not saved as a floor's
    "set_current_home_dock": 404,
    "search_nearby_home_dock": 404,
    "set_pose_by_homedock": 404,
    "set_pose_by_poi": 404,
    "dispatch_by_pois": 404,
    "get_elevators_by_id": 400,  # nor are there elevators on it
    "get_pose_relation_to_elevator": 400,
    "post_task_event": 404,  # no call came in
    "cancel_task_by_task_id": 404,
    "cancel_task_by_order_id": 404,
    "start_pickup": 403,  # it is not delivering
    "end_pickup": 403,
    "end_operation": 403,
}


@pytest.mark.world("office", body="hermes")
async def test_every_operation_reaches_the_door_and_is_answered(
    client: SlamwareClient, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    class Recorder:
        def get(self, key: str) -> object:
            asked.append(key)
            return TABLE.get(key)

    monkeypatch.setattr(dispatch, "TABLE", Recorder())
    await forward(seconds=2)
    drawn = await client.get_composite_map()
    cargo = (await client.get_cargos())[0]
    values = VALUES | {"set_composite_map": {"body": drawn}, "upload_map": {"body": drawn}}
    wrong = []
    for row in contract("slamware"):
        name = method_of(row.name)
        for before in BEFORE.get(name, ()):
            await getattr(client, before)(**values.get(before, {}))
        wanted = REFUSED.get(name, 200) if row.key in TABLE else 501
        given = values.get(name, {}) | ({"cargo_id": cargo.id} if "cargo_id" in values.get(name, {}) else {})
        if name in LISTED:
            given["id"] = (await getattr(client, LISTED[name])(given["usage"]))[-1].id
        asked.clear()
        try:
            await getattr(client, name)(**given)
            status: int | str = 200
        except SlamwareRefused as refused:
            status = refused.code
        assert asked == [row.key]
        if name in ("wakeup", "restart_module"):
            await forward(seconds=10)
        if status != wanted and name not in UNDECIDED:
            wrong.append(f"{name}: {status} instead of {wanted}")
    assert not wrong, "\n".join(wrong)
