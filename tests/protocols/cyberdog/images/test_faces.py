"""Chapter "faces": anna's face is entered, and known again."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.model.components.interaction.members import Member, Members
from roboglot.model.geometry import Pose
from tests.protocols.cyberdog.phone import App, Client

pytestmark = pytest.mark.world("playground", body="cyberdog2")


async def test_a_face_is_entered_and_known_again(client: Client, app: App, robot, anna, passing, forward) -> None:
    assert await client.ask(7001, {"command": 0, "username": "anna", "ishost": True}) == {"result": 0}
    assert (await client.ask(1021, {"account": "anna"}))["accounts"][0]["face_state"] == 2
    assert await client.ask(7001, {"command": 0, "username": "ben"}) == {"result": 5911}
    assert await client.ask(7002, {"command": 0}) == {"result": 5901}
    await passing(lambda: app.of(7003))
    assert app.of(7003) == [{"result": 0, "username": "anna"}]
    assert robot[Members].get("anna").face
    assert robot[Members].get("anna").host
    assert (await client.ask(1021, {"account": "anna"}))["accounts"][0]["face_state"] == 1
    assert await client.ask(7001, {"command": 2, "username": "anna"}) == {"result": 0}
    assert await client.ask(7001, {"command": 5}) == {"result": 0, "allfaces": "anna"}
    assert await client.ask(7002, {"command": 1, "username": "anna", "id": 9, "timeout": 5}) == {"result": 0}
    await passing(lambda: app.of(7004))
    seen = app.of(7004)[0]
    assert (seen["username"], seen["result"], seen["id"]) == ("anna", 0, 9)
    assert 20 < seen["age"] < 40
    await forward(seconds=6)
    assert 4 <= len(app.of(7004)) <= 6
    # The same face belongs to no other person.
    assert await client.ask(7001, {"command": 0, "username": "ben"}) == {"result": 0}
    await passing(lambda: len(app.of(7003)) == 2)
    assert app.of(7003)[1] == {"result": 5921, "username": "ben"}


async def test_of_entries_at_once_one_begins(client, app, robot, anna, passing, monkeypatch) -> None:
    adding, stored, add = asyncio.Event(), asyncio.Event(), robot[Members].add

    async def add_slowly(name: str, *, host: bool = False) -> Member:
        if name == "anna":
            adding.set()
            await stored.wait()
        return await add(name, host=host)

    monkeypatch.setattr(robot[Members], "add", add_slowly)
    first = asyncio.ensure_future(client.ask(7001, {"command": 0, "username": "anna"}))
    await adding.wait()
    assert await client.ask(7001, {"command": 0, "username": "ben"}) == {"result": 5911}
    assert await client.ask(7002, {"command": 0}) == {"result": 5901}
    stored.set()
    assert await first == {"result": 0}
    await passing(lambda: app.of(7003))
    assert app.of(7003) == [{"result": 0, "username": "anna"}]
    assert [member.name for member in robot[Members].all()] == ["anna"]


async def test_faces_are_renamed_and_deleted(client, app, robot, anna, passing) -> None:
    await client.ask(7001, {"command": 0, "username": "anna"})
    await passing(lambda: app.of(7003))
    assert await client.ask(7001, {"command": 3, "oriname": "anna", "username": "eva"}) == {"result": 0}
    assert robot[Members].get("eva").face
    assert await client.ask(7001, {"command": 3, "oriname": "anna", "username": "x"}) == {"result": 5910}
    assert await client.ask(7001, {"command": 4, "username": "eva"}) == {"result": 0}
    assert robot[Members].get("eva").face is None
    for gone in ({"command": 3, "oriname": "eva", "username": "x"}, {"command": 4, "username": "eva"}):
        assert await client.ask(7001, gone) == {"result": 5910}
    assert await client.ask(7001, {"command": 4, "username": "anna"}) == {"result": 5910}
    assert await client.ask(7001, {"command": 77}) == {"result": 5910}


async def test_a_face_being_entered_keeps_its_member(client, app, robot, anna, world, passing) -> None:
    world.stage.place("a", Pose(1.0, 1.0, 3.14))  # facing a wall
    await client.ask(7001, {"command": 0, "username": "ben"})
    assert await client.ask(1022, {"member": "ben"}) == {"success": True}
    await passing(lambda: app.of(7003))
    assert app.of(7003) == [{"result": 5904, "username": "ben"}]  # at once, and the camera is free again
    assert await client.ask(7001, {"command": 0, "username": "anna"}) == {"result": 0}
    assert await client.ask(1024, {"pre_name": "anna", "new_name": "eva"}) == {"success": True}
    assert (await client.ask(1021, {"account": "eva"}))["accounts"][0]["face_state"] == 2
    world.stage.place("a", Pose(anna.pose.x - 3.0, anna.pose.y, 0.0))
    await passing(lambda: len(app.of(7003)) == 2)
    assert app.of(7003)[1] == {"result": 0, "username": "eva"}
    assert robot[Members].get("eva").face
    assert await client.ask(7001, {"command": 2, "username": "eva"}) == {"result": 0}


async def test_recognition_follows_the_name_of_its_member(client, app, robot, anna, world, passing) -> None:
    await robot[Members].add("anna")
    await robot[Members].set_face("anna", anna.face)
    world.stage.place("a", Pose(1.0, 1.0, 3.14))  # facing a wall
    assert await client.ask(7002, {"command": 1, "username": "anna", "timeout": 9}) == {"result": 0}
    assert await client.ask(1024, {"pre_name": "anna", "new_name": "eva"}) == {"success": True}
    world.stage.place("a", Pose(anna.pose.x - 3.0, anna.pose.y, 0.0))
    await passing(lambda: app.of(7004))
    assert (app.of(7004)[0]["username"], app.of(7004)[0]["result"]) == ("eva", 0)


async def test_no_one_is_recognised_there(client, app, robot, anna, world, passing) -> None:
    world.stage.place("a", Pose(1.0, 1.0, 3.14))  # facing a wall
    await robot[Members].add("anna")
    await robot[Members].set_face("anna", anna.face)
    assert await client.ask(7002, {"command": 0, "timeout": 2}) == {"result": 0}
    await passing(lambda: app.of(7004))
    assert app.of(7004)[0]["result"] == 5907


@pytest.mark.slow  # minutes; in short: test_no_one_is_recognised_there
async def test_enrolling_fails_without_a_face(client, app, robot, anna, world, passing, forward) -> None:
    world.stage.place("a", Pose(1.0, 1.0, 3.14))  # facing a wall
    assert await client.ask(7001, {"command": 1}) == {"result": 5903}
    assert await client.ask(7001, {"command": 0, "username": "anna"}) == {"result": 0}
    assert await client.ask(7001, {"command": 1}) == {"result": 0}
    assert await client.ask(7001, {"command": 0, "username": "anna"}) == {"result": 0}
    await passing(lambda: app.of(7003))
    assert app.of(7003) == [{"result": 5907, "username": "anna"}]
    assert await client.ask(7002, {"command": 0, "timeout": 2}) == {"result": 0}
    await passing(lambda: app.of(7004))
    assert app.of(7004)[0]["result"] == 5907
    assert await client.ask(7002, {"command": 0}) == {"result": 0}
    assert await client.ask(7002, {"command": 2}) == {"result": 0}
    await forward(seconds=65)
    assert len(app.of(7004)) == 1


@pytest.mark.parametrize(("asked", "taken"), [(0, 1), (301, 300)])
async def test_changed_timeout_of_recognition_is_logged(
    client, caplog: pytest.LogCaptureFixture, asked: int, taken: int
) -> None:
    caplog.set_level("INFO", "roboglot")
    assert await client.ask(7002, {"command": 0, "timeout": asked}) == {"result": 0}
    assert f"a timeout of {asked} s is taken for {taken} s" in caplog.text
    assert await client.ask(7002, {"command": 2}) == {"result": 0}
