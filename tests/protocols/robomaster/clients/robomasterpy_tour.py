"""Run by test_robomasterpy.py in a separate process: PyPI's robomasterpy, unmodified, against a robot on argv[1]."""

import dataclasses
import json
import queue
import sys
import time

from robomasterpy import framework
from robomasterpy.client import Commander, get_broadcast_ip


def wait_until(reached) -> None:
    deadline = time.monotonic() + 60
    while not reached():
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.02)


def broadcasts(ip: str) -> bool:
    """Return whether the robot was heard next; other robots on this machine broadcast, and other clients listen."""
    try:
        return get_broadcast_ip(60) == ip
    except OSError:  # the port is in use
        return False


def main(ip: str) -> None:  # noqa: PLR0915 - one tour
    wait_until(lambda: broadcasts(ip))
    seen: dict[str, object] = {"broadcast": ip}
    robot = Commander(ip, timeout=60)
    second = Commander(ip, timeout=60)  # the framework opens one per worker
    seen["ip"] = robot.get_ip()
    seen["version"] = robot.version()
    seen["mode at first"] = robot.get_robot_mode()
    seen["mode set"] = robot.robot_mode("free")
    seen["mode then"] = second.get_robot_mode()
    second.close()
    seen["move"] = robot.chassis_move(x=0.3, y=0.1, z=30.0, speed_xy=0.5, speed_z=60)
    wait_until(lambda: robot.get_chassis_position().x > 0.28 and abs(robot.get_chassis_speed().x) < 0.01)
    wait_until(lambda: robot.get_chassis_status().static)
    seen["position"] = dataclasses.astuple(robot.get_chassis_position())
    seen["attitude"] = dataclasses.astuple(robot.get_chassis_attitude())
    seen["speed"] = robot.chassis_speed(x=0.2)
    wait_until(lambda: robot.get_chassis_speed().x > 0.15)
    seen["moving"] = not robot.get_chassis_status().static
    seen["wheel"] = robot.chassis_wheel(0, 0, 0, 0)

    pushed: queue.Queue[object] = queue.Queue()
    listener = framework.PushListener("listener", pushed)
    happened: queue.Queue[object] = queue.Queue()
    events = framework.EventListener("events", happened, ip)
    seen["push on"] = robot.chassis_push_on(position_freq=10, attitude_freq=20, status_freq=5)
    for _ in range(40):
        listener.work()
    seen["push off"] = robot.chassis_push_off(all=True)
    seen["gimbal push"] = robot.gimbal_push_on(attitude_freq=20)
    for _ in range(10):
        listener.work()
    seen["gimbal push off"] = robot.gimbal_push_off()
    listener._conn.close()
    seen["pushed"] = sorted({type(pushed.get()).__name__ for _ in range(pushed.qsize())})

    seen["gimbal"] = [
        robot.gimbal_speed(0, 30),
        robot.gimbal_speed(0, 0),
        robot.gimbal_move(pitch=5, yaw=20, pitch_speed=90, yaw_speed=90),
        robot.gimbal_moveto(pitch=-10, yaw=0, pitch_speed=90, yaw_speed=90),
    ]
    attitude = robot.get_gimbal_attitude()
    seen["aimed"] = abs(attitude.pitch + 10) < 1 and abs(attitude.yaw) < 1
    seen["gimbal more"] = [robot.gimbal_suspend(), robot.gimbal_resume(), robot.gimbal_recenter()]
    seen["armor"] = [robot.armor_sensitivity(10), robot.get_armor_sensitivity(), robot.armor_event("hit", True)]
    seen["sound"] = robot.sound_event("applause", True)
    seen["led"] = robot.led_control("all", "blink", 255, 0, 0)
    seen["ir on"] = robot.ir_sensor_measure(True)
    wait_until(lambda: robot.get_ir_sensor_distance(1) > 0)
    seen["fire"] = robot.blaster_fire()
    print("TOUCH ME", flush=True)
    events.work()
    event = happened.get()
    assert dataclasses.is_dataclass(event)
    assert not isinstance(event, type)
    seen["event"] = dataclasses.astuple(event)
    events._conn.close()

    seen["audio"] = [robot.audio(True), robot.audio(False)]
    seen["stream"] = robot.stream(True)
    frames: queue.Queue[object] = queue.Queue()
    vision = framework.Vision("vision", frames, ip, lambda frame, logger: frame.shape)  # noqa: ARG005 - by name
    for _ in range(3):
        vision.work()
    seen["frame"] = frames.get()
    vision._cap.release()
    seen["stream off"] = robot.stream(False)
    seen["quit"] = robot.do("quit")
    robot.close()
    print("SEEN", json.dumps(seen))


main(sys.argv[1])
