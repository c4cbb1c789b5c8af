"""Walls, tracks and areas through a real socket: kept with ids and metadata, for navigation and after a restart."""

import httpx
import pytest

from roboglot.model.components.mapping.annotations import AreaKind, LineKind, MapAnnotations
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

LINES, AREAS = "/api/core/artifact/v1/lines", "/api/core/artifact/v1/rectangle-areas"
WALL = {"id": 7, "start": {"x": 0, "y": 1}, "end": {"x": 2, "y": 1}, "metadata": {"colour": "red"}}
CURVE = {
    "start": {"x": 0, "y": 0},
    "end": {"x": 3, "y": 0},
    "metadata": {"control_point1": "{'x':0.5,'y':1}", "control_point2": '{"x":2.5,"y":1}', "route_id": "七"},
}
RECTANGLE = {"start": {"x": 0, "y": 0}, "end": {"x": 4, "y": 0}, "half_width": 0.5}


async def test_lines_are_added_changed_and_removed(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    assert (await bare_client.get(f"{LINES}/walls")).json() == []
    added = await bare_client.post(f"{LINES}/walls", json=[WALL, {**WALL, "metadata": []}])
    assert (added.status_code, added.json()) == (200, True)
    await bare_client.post(f"{LINES}/tracks", json=[CURVE])
    walls = (await bare_client.get(f"{LINES}/walls")).json()
    assert [(wall["id"], wall["metadata"]) for wall in walls] == [(1, {"colour": "red"}), (2, {})]
    assert (await bare_client.get(f"{LINES}/tracks")).json() == [{**CURVE, "id": 3}]

    (track,) = bare[MapAnnotations].current.lines_of(LineKind.TRACK)
    assert track.control == (Point(0.5, 1), Point(2.5, 1))

    moved = {**WALL, "id": 2, "end": {"x": 9, "y": 9}}
    assert (await bare_client.put(f"{LINES}/walls", json=[moved])).json() is True
    assert bare[MapAnnotations].current.lines_of(LineKind.WALL)[1].end == Point(9, 9)
    assert (await bare_client.put(f"{LINES}/walls", json=[{**WALL, "id": 1}, {**WALL, "id": 3}])).status_code == 404

    assert (await bare_client.delete(f"{LINES}/walls/1")).json() is True
    assert (await bare_client.delete(f"{LINES}/walls/3")).status_code == 404  # a track
    assert (await bare_client.delete(f"{LINES}/walls")).json() is True
    assert [line.kind for line in bare[MapAnnotations].current.lines] == [LineKind.TRACK]


@pytest.mark.parametrize(
    "metadata", [{"control_point1": "{'x':0.1,'y':0.1}"}, {"control_point1": "nonsense", "control_point2": "{}"}]
)
async def test_half_a_curve_is_refused(bare: Robot, bare_client: httpx.AsyncClient, metadata: dict[str, str]) -> None:
    assert (await bare_client.post(f"{LINES}/tracks", json=[{**CURVE, "metadata": metadata}])).status_code == 400
    assert not bare[MapAnnotations].current.lines


@pytest.mark.parametrize(
    ("usage", "metadata", "why"),
    [
        ("elevator_area", {"elevator_door_type": "3"}, "elevator_door_type is one of 0, 1, 2, not 3"),
        ("elevator_area", {"elevator_sill_width": "wide"}, "elevator_sill_width is a number up to 10, not wide"),
        ("elevator_area", {"elevator_scheduling_point_dist": "-1"}, "elevator_scheduling_point_dist is a number"),
        ("dangerous_area", {"dangerous_area_type": "01"}, "dangerous_area_type is one of 0, 1, not 01"),
    ],
)
async def test_settings_no_robot_can_follow_are_refused(
    bare: Robot, bare_client: httpx.AsyncClient, usage: str, metadata: dict[str, str], why: str
) -> None:
    reply = await bare_client.post(f"{AREAS}/{usage}", json={"area": RECTANGLE, "metadata": metadata})
    assert (reply.status_code, why in reply.text) == (400, True)
    assert not bare[MapAnnotations].current.areas
    assert (await bare_client.post(f"{AREAS}/{usage}", json={"area": RECTANGLE, "metadata": {}})).json() is True
    (area,) = (await bare_client.get(f"{AREAS}/{usage}")).json()
    changed = await bare_client.put(f"{AREAS}/{usage}/{area['id']}", json={"metadata": metadata})
    assert (changed.status_code, why in changed.text) == (400, True)


async def test_areas_of_all_kinds_with_their_metadata(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    metadata = {
        "forbidden_area": {"escape_distance": "0.4"},
        "elevator_area": {"elevator_id": "e", "elevator_sill_width": "0.4", "elevator_scheduling_point_dist": "1"},
        "dangerous_area": {"dangerous_area_type": "0", "max_line_speed": "0.5"},
        "coverage_area": {},
        "maintenance_area": {},
        "sensor_disable_area": {"sensor_type": "[0，3]"},
        "restricted_area": {"restricted_robots_number_limit": "1"},
    }
    for usage, values in metadata.items():
        answer = await bare_client.post(f"{AREAS}/{usage}", json={"area": RECTANGLE, "metadata": values})
        assert (answer.status_code, answer.json()) == (200, True)
    for id, (usage, values) in enumerate(metadata.items(), 1):
        expected = [{"id": id, "usage": usage, "area": RECTANGLE, "metadata": values}]
        assert (await bare_client.get(f"{AREAS}/{usage}")).json() == expected
    kinds = {area.kind: area for area in bare[MapAnnotations].current.areas}
    assert len(kinds) == 7
    assert kinds[AreaKind.FORBIDDEN].escape == 0.4
    assert kinds[AreaKind.DANGEROUS].speed_max == 0.5
    assert kinds[AreaKind.SENSOR_DISABLE].sensors == {"bumper", "depth camera"}
    assert kinds[AreaKind.RESTRICTED].robots_max == 1

    change = {"metadata": {"max_line_speed": "0.2"}}
    assert (await bare_client.put(f"{AREAS}/dangerous_area/3", json=change)).json() is True
    (dangerous,) = bare[MapAnnotations].current.areas_of(AreaKind.DANGEROUS)
    assert (dangerous.id, dangerous.speed_max, dangerous.end) == (3, 0.2, Point(4, 0))
    assert (await bare_client.put(f"{AREAS}/dangerous_area/1", json=change)).status_code == 404
    assert (await bare_client.delete(f"{AREAS}/dangerous_area/1")).status_code == 404
    assert (await bare_client.delete(f"{AREAS}/dangerous_area/3")).json() is True
    assert (await bare_client.delete(f"{AREAS}/forbidden_area")).json() is True
    assert len(bare[MapAnnotations].current.areas) == 5


async def test_nonsense_is_refused(bare_client: httpx.AsyncClient) -> None:
    for usage, values in (
        ("dangerous_area", {"max_line_speed": "fast"}),
        ("sensor_disable_area", {"sensor_type": "9"}),
    ):
        answer = await bare_client.post(f"{AREAS}/{usage}", json={"area": RECTANGLE, "metadata": values})
        assert answer.status_code == 400
    assert (await bare_client.get(f"{AREAS}/parking_area")).status_code == 400
    assert (await bare_client.get(f"{LINES}/ropes")).status_code == 400
    far = {"start": {"x": 0, "y": 0}, "end": {"x": 1e300, "y": 0}}
    assert (await bare_client.post(f"{LINES}/walls", json=[far])).status_code == 400
