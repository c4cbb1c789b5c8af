"""Every command of the contract once, through the client, against our own door."""

from collections.abc import Awaitable, Callable

import pytest

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.wire.contracts import contract

Client = RoboMasterClient
BUILDS = pytest.mark.parametrize("profile", ["spec", "fw60", "fw70"], indirect=True)
pytestmark = pytest.mark.world("empty", body="robomaster_ep")

ARM = (5, 4)
CALLS: dict[str, tuple[Callable[[Client], Awaitable[object]], object]] = {
    "command": (lambda c: c.command(), None),
    "robot mode": (lambda c: c.robot.mode("free"), None),
    "robot mode ?": (lambda c: c.robot.get_mode(), "free"),
    "robot battery ?": (lambda c: c.robot.get_battery(), int),
    "chassis speed": (lambda c: c.chassis.speed(x=0.1, z=10.0), None),
    "chassis wheel": (lambda c: c.chassis.wheel(10, 10, 10, 10), None),
    "chassis move": (lambda c: c.chassis.move(x=0.05, wait=True), None),
    "chassis stop": (lambda c: c.chassis.stop(), None),
    "chassis speed ?": (lambda c: c.chassis.get_speed(), "ChassisSpeed"),
    "chassis position ?": (lambda c: c.chassis.get_position(), "ChassisPose"),
    "chassis attitude ?": (lambda c: c.chassis.get_attitude(), "ChassisAttitude"),
    "chassis status ?": (lambda c: c.chassis.get_status(), "ChassisStatus"),
    "chassis push": (lambda c: c.chassis.push(position=True, pfreq=10, attitude=False), None),
    "gimbal speed": (lambda c: c.gimbal.speed(p=5), None),
    "gimbal move": (lambda c: c.gimbal.move(p=5, vp=60), None),
    "gimbal moveto": (lambda c: c.gimbal.moveto(p=0, wait=False), None),
    "gimbal suspend": (lambda c: c.gimbal.suspend(), None),
    "gimbal resume": (lambda c: c.gimbal.resume(), None),
    "gimbal recenter": (lambda c: c.gimbal.recenter(), None),
    "gimbal stop": (lambda c: c.gimbal.stop(), None),
    "gimbal attitude ?": (lambda c: c.gimbal.get_attitude(), "GimbalAttitude"),
    "gimbal push": (lambda c: c.gimbal.push(True, afreq=20), None),
    "blaster bead": (lambda c: c.blaster.bead(3), None),
    "blaster bead ?": (lambda c: c.blaster.get_bead(), 3),
    "blaster fire": (lambda c: c.blaster.fire(), None),
    "armor sensitivity": (lambda c: c.armor.sensitivity(7), None),
    "armor sensitivity ?": (lambda c: c.armor.get_sensitivity(), 7),
    "armor event": (lambda c: c.armor.event(True), None),
    "sound event": (lambda c: c.sound.event(True), None),
    "pwm value": (lambda c: c.pwm.value(0x3, 50), None),
    "pwm freq": (lambda c: c.pwm.freq(0x3, 1000), None),
    "led control": (lambda c: c.led.control("all", "blink", 255, 0, 0, blink_freq=3), None),
    "sensor_adapter adc ?": (lambda c: c.sensor_adapter.get_adc(1, 2), 0.0),
    "sensor_adapter io_level ?": (lambda c: c.sensor_adapter.get_io_level(1, 2), 0),
    "sensor_adapter pulse_period ?": (lambda c: c.sensor_adapter.get_pulse_period(1, 2), 0),
    "sensor_adapter event": (lambda c: c.sensor_adapter.event(True), None),
    "ir_distance_sensor measure": (lambda c: c.ir_distance_sensor.measure(True), None),
    "ir_distance_sensor distance ?": (lambda c: c.ir_distance_sensor.get_distance(1), float),
    "servo angle": (lambda c: c.servo.angle(1, 20), None),
    "servo speed": (lambda c: c.servo.speed(1, 30), None),
    "servo stop": (lambda c: c.servo.stop(), None),
    "servo recenter": (lambda c: c.servo.recenter(1), None),
    "servo angle ?": (lambda c: c.servo.get_angle(1), float),
    "robotic_arm move": (lambda c: c.robotic_arm.move(1, 0), None),
    "robotic_arm moveto": (lambda c: c.robotic_arm.moveto(*ARM), None),
    "robotic_arm recenter": (lambda c: c.robotic_arm.recenter(wait=True), None),
    "robotic_arm stop": (lambda c: c.robotic_arm.stop(), None),
    "robotic_arm position ?": (lambda c: c.robotic_arm.get_position(), "ArmPosition"),
    "robotic_gripper open": (lambda c: c.robotic_gripper.open(2), None),
    "robotic_gripper close": (lambda c: c.robotic_gripper.close(), None),
    "robotic_gripper stop": (lambda c: c.robotic_gripper.stop(), None),
    "robotic_gripper status ?": (lambda c: c.robotic_gripper.get_status(), int),
    "AI attribute": (lambda c: c.ai.attribute(line_color="blue", marker_dist=1), None),
    "AI push": (lambda c: c.ai.push(marker=True, line=True), None),
    "camera exposure": (lambda c: c.camera.exposure("small"), None),
    "stream on": (lambda c: c.stream.on(), None),
    "stream off": (lambda c: c.stream.off(), None),
    "audio on": (lambda c: c.audio.on(), None),
    "audio off": (lambda c: c.audio.off(), None),
    "game_msg on": (lambda c: c.game_msg.on(), None),
    "game_msg off": (lambda c: c.game_msg.off(), None),
    "version": (lambda c: c.version(), str),
    "quit": (lambda c: c.quit(), None),
}
MESSAGES = {row.key for row in contract("robomaster") if row.key.startswith("> ")}


def test_no_command_is_left_out() -> None:
    assert {row.key for row in contract("robomaster")} - MESSAGES - set(CALLS) == set()


@BUILDS
async def test_every_command_through_the_client(client, run, profile, monkeypatch) -> None:
    if profile != "spec":
        monkeypatch.setattr(f"{__name__}.ARM", (120, 60))  # mm from the shoulder
    sent: list[str] = []
    ask = client._link.ask

    async def note(command: str, timeout: float) -> str:
        sent.append(command)
        answer: str = await ask(command, timeout)
        return answer

    monkeypatch.setattr(client._link, "ask", note)
    for key, (call, right) in CALLS.items():
        got = await run(call(client))
        assert sent[-1].startswith(key.removesuffix(" ?"))
        assert sent[-1].endswith("?") == key.endswith("?"), key
        if isinstance(right, type):
            assert type(got) is right, key
        elif isinstance(right, str) and right[0].isupper():
            assert type(got).__name__ == right, key
        else:
            assert got == right, key
    assert len(sent) == len(CALLS), "one command each"
