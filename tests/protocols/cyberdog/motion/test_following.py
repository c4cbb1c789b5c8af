"""Following a person by sight: boxes, the app's choice, the way, losing sight, stopping."""

from __future__ import annotations

import asyncio
import logging

import pytest

from roboglot.model.components.system.lease import Lease
from roboglot.model.geometry import Pose
from tests.protocols.cyberdog.phone import App, Client, Stream, state, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")


@pytest.mark.slow  # in short: test_it_keeps_near_who_walks
async def test_the_person_chosen_is_followed(client: Client, app: App, robot, world, anna, passing, forward) -> None:
    nowhere = {"x_offset": 0, "y_offset": 0, "height": 10, "width": 10}
    assert await client.ask(6008, {"roi": nowhere}) == {"success": False}  # no task
    assert await client.ask(6008, {"roi": {"x_offset": 1}}) == {"error_code": 323}
    stream = Stream(client, 6004, {"type": 13, "relative_pos": 201, "keep_distance": 1.2})
    await passing(lambda: any(push["body_info_roi"] for push in app.of(6007)))
    assert stream.answers[0] == {"accepted": 1}
    assert stream.codes == [1000, 500, 501]
    assert await state(client) == 13
    reported = app.of(6007)[-1]
    assert (reported["track_res_roi"]["width"], reported["track_res_roi"]["height"]) == (0, 0)
    roi = reported["body_info_roi"][0]["roi"]
    assert 0 <= roi["x_offset"] < roi["x_offset"] + roi["width"] <= 640
    assert await client.ask(6008, {"roi": nowhere}) == {"success": False}
    assert await client.ask(6004, {"type": 7}) == {"accepted": 2}
    assert await client.ask(6008, {"roi": roi}) == {"success": True}
    assert await client.ask(6008, {"roi": roi}) == {"success": False}  # a person is chosen
    await passing(lambda: 503 in stream.codes)
    await forward(seconds=8)
    assert 0.8 < world.truth.pose_of("a").distance_to(anna.pose) < 1.6
    assert any(push["track_res_roi"]["height"] > 0 for push in app.of(6007))
    stopped = asyncio.ensure_future(client.ask(6009, {"type": 13}))
    await passing(stopped.done)  # it brakes
    assert stopped.result() == {"result": 0}
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 5}
    assert stream.codes[:5] == [1000, 500, 501, 502, 503]
    assert await state(client) == 101
    count = len(app.of(6007))
    await forward(seconds=1)
    assert len(app.of(6007)) <= count + 1


@pytest.mark.slow  # long; tests/autonomy/test_following.py has losing a person
async def test_long_loss_of_the_person_ends_following(client, app, robot, world, anna, passing) -> None:
    stream = Stream(client, 6004, {"type": 13})
    await passing(lambda: any(push["body_info_roi"] for push in app.of(6007)))
    await client.ask(6008, {"roi": app.of(6007)[-1]["body_info_roi"][0]["roi"]})
    await passing(lambda: 503 in stream.codes)
    world.stage.place("a", Pose(1.0, 1.0, 3.14))  # carried away, its nose to the wall
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 3}
    assert stream.codes[-2:] == [504, 505]


async def test_choice_is_optional_but_side_must_be_known(client, app, robot, anna, passing, forward) -> None:
    assert await client.ask(6004, {"type": 13, "relative_pos": 7}) == {"error_code": 323}
    stream = Stream(client, 6004, {"type": 13})
    await passing(lambda: 501 in stream.codes)
    assert await client.ask(6009, {"type": 13}) == {"result": 0}
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 5}


@pytest.mark.slow
async def test_thing_in_picture_is_followed_wherever_it_goes(
    client: Client, app: App, robot, world, anna, passing, forward
) -> None:
    """The camera is not needed: the lidar sees her as it sees any thing."""
    await forward(seconds=0.3)  # it has seen her: sockets may be quicker than its first scan
    stream = Stream(client, 6004, {"type": 13, "object_tracking": True, "keep_distance": 1.0})
    await passing(lambda: 501 in stream.codes)
    assert await state(client) == 3
    sky = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0}
    assert await client.ask(6008, {"roi": sky}) == {"success": False}
    assert app.of(6007) == []  # no boxes until a target is chosen
    middle = {"x_offset": 290, "y_offset": 150, "height": 220, "width": 60}
    assert await client.ask(6008, {"roi": middle}) == {"success": True}
    await passing(lambda: 503 in stream.codes)
    await passing(lambda: app.of(6007))
    box = app.of(6007)[0]["track_res_roi"]
    assert abs(box["x_offset"] + box["width"] / 2 - 320) < 20
    assert abs(box["y_offset"] - 150) < 40
    anna.walk_to(3.5, 6.8)
    await forward(seconds=10)
    assert anna.pose.distance_to(Pose(3.5, 6.8)) < 0.1
    assert 0.7 < world.truth.pose_of("a").distance_to(anna.pose) < 1.5
    assert app.of(6007)[-1]["track_res_roi"]["width"] > box["width"]  # it has come nearer
    joined = Stream(client, 6010, {"type": 3})
    await until(lambda: joined.answers and stream.ended)
    assert joined.answers[0] == {"accepted": 1}
    stopped = asyncio.ensure_future(client.ask(6009, {"type": 3}))  # the number of its state, as robots understand it
    await passing(stopped.done)
    await until(lambda: joined.ended)
    assert stream.codes[:5] == [1000, 500, 501, 502, 503]
    assert joined.answers[-1] == {"result": 5}


async def test_a_wall_is_no_thing_to_follow(client: Client, robot, world, passing, forward) -> None:
    world.stage.place("a", Pose(5.0, 2.5, -1.57))  # only the south wall ahead
    await forward(seconds=0.3)
    stream = Stream(client, 6004, {"type": 13, "object_tracking": True})
    await passing(lambda: 501 in stream.codes)
    middle = {"x_offset": 290, "y_offset": 150, "height": 220, "width": 60}
    assert await client.ask(6008, {"roi": middle}) == {"success": True}
    await passing(lambda: stream.ended)
    assert stream.codes[-1] == 507
    assert stream.answers[-2]["feedback_msg"]
    assert stream.answers[-1] == {"result": 3}
    assert await state(client) == 101


async def test_reason_against_following_is_logged(
    client: Client, app: App, robot, anna, passing, caplog: pytest.LogCaptureFixture
) -> None:
    """It was swallowed, as if another client could only be driving."""
    caplog.set_level(logging.INFO)
    stream = Stream(client, 6004, {"type": 13})
    await passing(lambda: any(push["body_info_roi"] for push in app.of(6007)))
    await robot[Lease].take("someone else")
    await client.ask(6008, {"roi": app.of(6007)[-1]["body_info_roi"][0]["roi"]})
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 3}
    assert any("VISION_FOLLOWING failed" in line and "someone else" in line for line in caplog.messages)
