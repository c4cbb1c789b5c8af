"""Run by test_robomasterpy.py in a process of its own: PyPI's robomasterpy, unmodified, against a robot on argv[1]."""

import dataclasses
import json
import queue
import sys
import time

from robomasterpy import framework
from robomasterpy.client import Commander, get_broadcast_ip


def wait_until(reached) -> None:
    deadline = time.monotonic() + 20
    while not reached():
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.02)


def main(ip: str) -> None:
    seen: dict[str, object] = {"broadcast": get_broadcast_ip(20)}
    robot = Commander(ip, timeout=20)
    second = Commander(ip, timeout=20)  # the framework opens one per worker
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
    events = framework.EventListener("events", queue.Queue(), ip)
    seen["push on"] = robot.chassis_push_on(position_freq=10, attitude_freq=20, status_freq=5)
    for _ in range(40):
        listener.work()
    seen["push off"] = robot.chassis_push_off(all=True)
    listener._conn.close()
    events._conn.close()
    seen["pushed"] = sorted({type(pushed.get()).__name__ for _ in range(pushed.qsize())})
    try:
        robot.gimbal_recenter()
    except AssertionError as refused:
        seen["gimbal"] = str(refused)
    seen["quit"] = robot.do("quit")
    robot.close()
    print("SEEN", json.dumps(seen))


main(sys.argv[1])
