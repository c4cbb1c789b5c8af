"""Messages that wait: velocities give way to newer ones, goals do not give way to velocities."""

from __future__ import annotations

import struct

from roboglot.protocols.ros2.intake import Intake


def velocity(x: float) -> bytes:
    return b"\x00\x01\x00\x00" + struct.pack("<6d", x, 0, 0, 0, 0, 0)


def test_flood_of_velocities_pushes_out_no_goal() -> None:
    dropped: list[str] = []
    intake = Intake(3, dropped.append)
    for x in range(100):
        intake.put("cmd_vel", velocity(x))
    intake.put("goal_pose", b"goal")
    for x in range(100):
        intake.put("cmd_vel", velocity(x))
    assert [intake.pop() for _ in range(len(intake))] == [("goal_pose", b"goal"), ("cmd_vel", velocity(99))]
    assert dropped == []


def test_full_queue_drops_oldest_of_its_topic() -> None:
    dropped: list[str] = []
    intake = Intake(3, dropped.append)
    intake.put("initialpose", b"here")
    for number in range(5):
        intake.put("goal_pose", bytes([number]))
    assert dropped == ["goal_pose", "goal_pose"]
    assert [intake.pop()[1] for _ in range(len(intake))] == [b"here", b"\x02", b"\x03", b"\x04"]


def test_only_the_newest_velocity_can_stop() -> None:
    intake = Intake(3, lambda _: None)
    intake.put("cmd_vel", velocity(0))
    assert intake.stops()
    intake.put("cmd_vel", velocity(1))
    assert not intake.stops()
    intake.pop()
    assert not intake
