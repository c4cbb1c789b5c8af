"""Chapters "settings", "members", "audio": what is set is found again, and does what it says."""

from __future__ import annotations

import asyncio
import logging

import pytest

from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.interaction.skin import ElectronicSkin, Shade, SkinPattern
from roboglot.model.components.interaction.speaker import SPEAKER, Speaker
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Refused
from roboglot.model.events import Spoke
from roboglot.model.geometry import Pose
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from tests.protocols.cyberdog.phone import ADDRESS, App, Client, Stream, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")
DEFAULT = "铁蛋"


@pytest.fixture
def anna(world, robot):
    """A person two metres ahead of the robot who looks at it."""
    person = world.stage.person("anna")
    at = person.pose
    world.stage.place("a", Pose(at.x - 2.0, at.y, 0.0))
    return person


async def test_nickname_is_kept_and_can_be_switched_off(client: Client) -> None:
    assert await client.ask(1011, {"nick_name": "Rex", "wake_name": ""}) == {"success": True}
    names = await client.ask(1001, {"is_nick_name": True})
    assert names["nick_name"] == {"default_name": DEFAULT, "current_name": "Rex"}
    assert await client.ask(1010, {"enable": False}) == {"success": True}
    assert (await client.ask(1001, {"is_nick_name": True}))["nick_name"]["current_name"] == DEFAULT
    assert await client.ask(1010, {"enable": True}) == {"success": True}
    assert (await client.ask(1001, {"is_nick_name": True}))["nick_name"]["current_name"] == "Rex"
    assert await client.ask(1011, {"nick_name": ""}) == {"error_code": 323}
    assert await client.ask(1010) == {"error_code": 323}


async def test_the_volume_is_the_loudspeaker_s(client, robot, monkeypatch) -> None:
    async def no_space(key: str, value: object) -> None:
        raise Refused("the disk is full")

    assert await client.ask(1012, {"volume": 35}) == {"success": True}
    assert robot[Speaker].volume == pytest.approx(0.35)
    assert (await client.ask(1001, {"is_volume": True}))["volume"] == 35
    assert await client.ask(1012, {"volume": 101}) == {"success": False}
    with monkeypatch.context() as full:
        full.setattr(robot[Settings], "put", no_space)
        assert await client.ask(1012, {"volume": 36}) == {"error_code": 322}, "it was acknowledged before it was stored"
    assert robot[Speaker].volume == pytest.approx(0.35)
    robot[Speaker]._volume = None  # as after a restart
    assert robot[Speaker].volume == pytest.approx(0.35)


async def test_the_eyes_shine_as_bright_as_asked(client, robot) -> None:
    assert await client.ask(1015, {"eyelight": 50}) == {"success": True}
    assert {lamp.red for lamp in robot[Light].lamps("eyes")} == {128}
    assert await client.ask(1015, {"eyelight": 0}) == {"success": True}
    assert {lamp.red for lamp in robot[Light].lamps("eyes")} == {0}
    assert await client.ask(1015, {"eyelight": -1}) == {"success": False}


async def test_anyone_who_speaks_is_silenced(client, robot, forward) -> None:
    saying = robot[Speaker].say("a rather long sentence, which no one wants to hear to its end", source="another")
    await forward(seconds=0.2)
    assert await client.ask(1025) == {}
    assert saying.status.name == "CANCELED"
    assert robot.actions.running(SPEAKER) == []


async def test_members_come_go_and_change_their_names(client, robot) -> None:
    assert await client.ask(1020, {"member": "anna"}) == {"success": True}
    assert await client.ask(1020, {"member": "anna"}) == {"success": False}
    await robot[Members].set_face("anna", b"a face")
    assert await client.ask(1024, {"pre_name": "anna", "new_name": "eva"}) == {"success": True}
    assert await client.ask(1024, {"pre_name": "anna", "new_name": "x"}) == {"success": False}
    known = {"id": robot[Members].get("eva").id, "name": "eva", "face_state": 1, "voice_state": 0}
    assert await client.ask(1021, {"account": "eva"}) == {"code": 0, "accounts": [known]}
    assert await client.ask(1021, {"account": ""}) == {"code": 0, "accounts": [known]}
    assert await client.ask(1023) == {"code": 0, "accounts": [known]}
    assert await client.ask(1021, {"account": "anna"}) == {"code": 121}
    assert await client.ask(1022, {"member": "eva"}) == {"success": True}
    assert await client.ask(1022, {"member": "eva"}) == {"success": False}
    assert await client.ask(1021) == {"code": 0, "accounts": []}


async def test_profile_of_real_robots_uses_their_wording(robot, data, pems, messages, passing) -> None:
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, profile="robot"), data)
    await door.start()
    async with pems.channel(door.port) as channel:
        client = Client(channel, messages)
        assert await client.ask(1020, {"member": "anna"}) == {"success": 0}
        assert await client.ask(1020, {"member": "anna"}) == {"success": 122}
        assert (await client.ask(1001, {"is_motor_temper": True}))["motor_temper"]["hip"][0] == "25.00"
        mapping = Stream(client, 6004, {"type": 5})
        await passing(lambda: 6 in mapping.codes and robot[Mapping].grid.width > 50)
        assert await client.ask(6009, {"type": 5, "map_name": "home"}) == {"result": 0}
        await passing(lambda: mapping.ended)
        assert mapping.answers[-1] == {"result": 5}
        assert (await client.ask(6003, {"mapName": "another"}))["mapName"] == "home"
    await door.close()


@pytest.mark.slow
async def test_enabled_wake_word_makes_it_listen_once(client, robot, anna, forward) -> None:
    anna.say(DEFAULT * 2 + "坐下")
    await forward(seconds=8)
    assert robot[Legs].posture is Posture.STANDING  # voice control is off
    assert await client.ask(1014, {"enable": True}) == {"success": True}
    assert (await client.ask(1001, {"is_voice_control": True, "is_mic_state": True})).items() >= {
        "voice_control": True,
        "mic_state": True,
    }.items()
    anna.say("坐下")  # not addressed to the robot
    await forward(seconds=20)
    assert robot[Legs].posture is Posture.STANDING
    anna.say(DEFAULT * 2 + "坐下")
    await forward(seconds=20)
    assert robot[Legs].posture is Posture.SITTING


async def test_a_closed_microphone_hears_nothing(client, robot, anna, forward) -> None:
    spoken: list[str] = []
    robot.events.listen(Spoke, lambda event: spoken.append(event.text))
    await client.ask(1014, {"enable": True})
    anna.say(DEFAULT * 2)
    await forward(seconds=8)
    assert spoken == ["我在"]
    assert await client.ask(1013, {"enable": False}) == {"success": True}
    anna.say(DEFAULT * 2)
    await forward(seconds=8)
    assert spoken == ["我在"]


async def test_a_voiceprint_is_learned_from_who_speaks(client, app: App, robot, anna, passing, forward) -> None:
    await client.ask(1020, {"member": "anna"})
    await passing(lambda: app.connected)
    assert await client.ask(3011, {"nick_name": "anna", "voiceprint_id": "v1"}) == {}
    assert (await client.ask(1021, {"account": "anna"}))["accounts"][0]["voice_state"] == 2
    anna.say("good morning, robot")
    await passing(lambda: app.of(3013))
    assert app.of(3013) == [{"code": 0, "voiceprint_id": "v1"}]
    assert robot[Members].get("anna").voice
    assert (await client.ask(1021, {"account": "anna"}))["accounts"][0]["voice_state"] == 1


async def test_training_is_cancellable_expires_and_needs_a_member(client, app, robot, passing, forward, world) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await client.ask(3011, {"nick_name": "unknown", "voiceprint_id": "v2"})
    await until(lambda: app.of(3013))
    assert app.of(3013) == [{"code": 5010, "voiceprint_id": "v2"}]
    await client.ask(1020, {"member": "ben"})
    await client.ask(3011, {"nick_name": "ben", "voiceprint_id": "v3"})
    assert await client.ask(3012) == {}
    await forward(seconds=1)
    assert (await client.ask(1021, {"account": "ben"}))["accounts"][0]["voice_state"] == 0
    assert len(app.of(3013)) == 1


async def test_a_voice_in_training_keeps_its_member(client, app, robot, anna, passing) -> None:
    await robot[Members].add("anna")
    await client.ask(3011, {"nick_name": "anna", "voiceprint_id": "v1"})
    await robot[Members].rename("anna", "eva")
    assert (await client.ask(1021, {"account": "eva"}))["accounts"][0]["voice_state"] == 2
    anna.say("good morning")
    await passing(lambda: app.of(3013))
    assert app.of(3013) == [{"code": 0, "voiceprint_id": "v1"}]
    assert robot[Members].get("eva").voice
    await client.ask(3011, {"nick_name": "eva", "voiceprint_id": "v2"})
    assert await client.ask(1022, {"member": "eva"}) == {"success": True}
    await passing(lambda: len(app.of(3013)) == 2)
    assert app.of(3013)[1] == {"code": 5010, "voiceprint_id": "v2"}
    await client.ask(1020, {"member": "anna"})
    await client.ask(3011, {"nick_name": "anna", "voiceprint_id": "v3"})
    await client.ask(1013, {"enable": False})  # without a microphone there is nothing to wait for
    await passing(lambda: len(app.of(3013)) == 3)
    assert app.of(3013)[2] == {"code": 5001, "voiceprint_id": "v3"}


@pytest.mark.slow
async def test_voice_board_is_activated_by_token_that_holds(client, app, robot, forward, passing) -> None:
    asked = await client.ask(3001)
    assert asked.keys() == {"did", "sn"}
    assert asked["sn"] == robot.description.serial
    assert asked == await client.ask(3001)
    assert (await client.ask(1001, {"is_audio_state": True, "uid": "77"}))["audio_state"] is False
    token = {"uid": 77, "token_access": "a", "token_fresh": "b", "token_expires_in": "60"}
    for wrong in ("soon", "6_0", "６０", " 60", "-60", "9" * 5000, 2**63, True):
        assert await client.ask(3002, {**token, "token_expires_in": wrong}) == {"result": False}, wrong
    for wrong in (-1, "-1", 2**64, "", "who", "7" * 65):
        assert await client.ask(3002, {**token, "uid": wrong}) == {"result": False}, wrong
    assert await client.ask(3002, token) == {"result": True}
    assert (await client.ask(1001, {"is_audio_state": True, "uid": "77"}))["audio_state"] is True
    assert (await client.ask(1001, {"is_audio_state": True, "uid": "78"}))["audio_state"] is False
    await passing(lambda: app.connected and app.ticks[-1].audio)
    await forward(seconds=61)
    assert (await client.ask(1001, {"is_audio_state": True, "uid": "77"}))["audio_state"] is False


async def test_voiceprints_are_asked_for_when_the_app_connects(client, app, passing) -> None:
    await client.ask(3002, {"uid": "77", "token_access": "a", "token_fresh": "b", "token_expires_in": "600"})
    await passing(lambda: app.of(3014))
    assert app.of(3014) == [{}]
    assert await client.ask(3014, {"voiceprints_data": "[]"}) == ""
    assert await client.ask(3014, {"voiceprints_data": "x" * 70_000}) == {"error_code": 323}
    await asyncio.sleep(0)


async def test_electronic_skin_follows_the_app(client, robot) -> None:
    skin = robot[ElectronicSkin]
    assert await client.ask(11002, {"mode": 2, "wave_cycle_time": 500}) == {"success": True}
    assert (skin.state.pattern, skin.state.cycle) == (SkinPattern.REARWARD, 0.5)
    for time, shade in ((0, Shade.LIGHT), (1, Shade.DARK)):
        assert await client.ask(11002, {"mode": 6, "wave_cycle_time": time}) == {"success": True}
        assert (skin.state.pattern, skin.state.standing) == (SkinPattern.FOOTFALLS, shade)
    assert await client.ask(11002, {"mode": 1, "wave_cycle_time": 0}) == {"success": True}
    assert set(skin.shades.values()) == {Shade.LIGHT}
    for mode, time in ((7, 500), (-1, 500), (4, 0), (4, 2**31 - 1)):
        assert await client.ask(11002, {"mode": mode, "wave_cycle_time": time}) == {"success": False}
    assert skin.state.pattern is SkinPattern.LIGHT
    assert await client.ask(11001, {"data": False}) == {"success": True, "message": ""}
    assert set(skin.shades.values()) == {Shade.DARK}
    assert await client.ask(11002, {"mode": 1, "wave_cycle_time": 0}) == {"success": False}
    assert await client.ask(11001, {"data": True}) == {"success": True, "message": ""}
    assert set(skin.shades.values()) == {Shade.LIGHT}
    for code, params in ((11001, {}), (11002, {"mode": 1}), (11002, {"wave_cycle_time": 500})):
        assert await client.ask(code, params) == {"error_code": 323}


@pytest.mark.world("empty", body="hermes")
async def test_a_robot_without_electronic_skin(client) -> None:
    assert await client.ask(11001, {"data": True}) == {"error_code": 322}
    assert await client.ask(11002, {"mode": 1, "wave_cycle_time": 0}) == {"error_code": 322}


REFUSED: tuple[tuple[int, dict[str, object]], ...] = (
    (1020, {"member": ""}),
    (1021, {"account": "nobody"}),
    (1022, {"member": "nobody"}),
    (1024, {"pre_name": "nobody", "new_name": "a"}),
    (5004, {"md5": "00"}),
    (6010, {"type": 5}),
    (7001, {"command": 1}),
    (7001, {"command": 2, "username": "a"}),
    (7001, {"command": 4, "username": "nobody"}),
    (7001, {"command": 9}),
    (7002, {"command": 9}),
    (8002, {}),
    (8009, {}),
    (9030, {"httplink": ""}),
    (10004, {"data": "production"}),
)


async def test_each_refusal_has_its_reason_in_the_log(client, caplog) -> None:
    caplog.set_level(logging.INFO)
    for code, params in REFUSED:
        caplog.clear()
        await client.ask(code, params)
        lines = [record.message for record in caplog.records if record.message.startswith(f"{code} refused: ")]
        assert [line for line in lines if line != f"{code} refused: "], (code, params)


async def test_last_moments_of_the_door_refuse_changes(client: Client, robot) -> None:
    robot.starts.down = "the robot restarts"
    assert await client.ask(1011, {"nick_name": "Rex", "wake_name": ""}) == {"error_code": 322}
    robot.starts.down = ""
    names = await client.ask(1001, {"is_nick_name": True})
    assert names["nick_name"]["current_name"] != "Rex"
