"""The courier's own tests, on robots of the test kit: `pytest -n 2`."""

import math

import pytest
from courier import Arm, Courier, RobotError


@pytest.fixture
def courier(robot_server):
    return Courier(robot_server.url, patience=120)


@pytest.fixture
def arm(robot_server):
    arm = Arm(robot_server.address)
    yield arm
    arm.close()


def far(server, x, y):
    """True distance of the robot from a place given relative to its start, m."""
    moved = server.moved()
    return math.hypot(moved.x - x, moved.y - y)


pytestmark = pytest.mark.world("empty", shared=True)


class TestDriving:
    @pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.4, 0.3), (0.4, -0.3)])
    def test_it_goes_there(self, robot_server, courier, x, y):
        courier.go(x, y)
        assert far(robot_server, x, y) < 0.25

    def test_it_delivers_and_comes_back(self, robot_server, courier):
        assert courier.deliver([(0.4, 0.0), (0.4, 0.3)]) == 2
        assert far(robot_server, 0.0, 0.0) < 0.25

    def test_it_says_where_it_is(self, robot_server, courier):
        assert courier.place() == pytest.approx((0.0, 0.0), abs=0.05)
        robot_server.forward(0.5)
        assert courier.place() == pytest.approx((0.0, 0.0), abs=0.05)

    def test_a_new_goal_replaces_the_old_one(self, robot_server, courier):
        body = {"action_name": "slamtec.agent.actions.MoveToAction",
                "options": {"target": {"x": 3, "y": 0, "z": 0}, "move_options": {"mode": 0}}}  # fmt: skip
        courier.ask("POST", "/api/core/motion/v1/actions", body)
        courier.go(0.4, 0.0)
        assert far(robot_server, 0.4, 0.0) < 0.25

    def test_stop_stops(self, robot_server, courier):
        body = {"action_name": "slamtec.agent.actions.MoveToAction",
                "options": {"target": {"x": 3, "y": 0, "z": 0}, "move_options": {"mode": 0}}}  # fmt: skip
        courier.ask("POST", "/api/core/motion/v1/actions", body)
        courier.stop()
        robot_server.forward(1.0)
        before = robot_server.pose()
        robot_server.forward(1.0)
        assert robot_server.pose().distance_to(before) < 0.02


class TestTrouble:
    @pytest.mark.fault("low_battery", charge=0.1)
    def test_it_stays_when_the_battery_is_low(self, robot_server, courier):
        with pytest.raises(RobotError, match="battery"):
            courier.go(0.5, 0.0)
        assert far(robot_server, 0.0, 0.0) < 0.05

    @pytest.mark.fault("emergency_stop")
    def test_it_reports_that_the_robot_did_not_go(self, robot_server, courier):
        with pytest.raises(RobotError):
            courier.go(0.5, 0.0)
        assert far(robot_server, 0.5, 0.0) > 0.3

    def test_a_bad_goal_is_refused(self, courier):
        with pytest.raises(RobotError, match="400"):
            courier.ask("POST", "/api/core/motion/v1/actions", {"action_name": "no.such.Action", "options": {}})

    def test_an_unknown_path_is_not_found(self, courier):
        with pytest.raises(RobotError, match="404"):
            courier.ask("GET", "/api/core/nothing")

    def test_a_robot_that_is_not_there_is_one_error(self):
        with pytest.raises(RobotError, match="does not answer"):
            Courier("http://127.0.0.1:9").battery()


class TestBattery:
    def test_it_is_full_enough(self, courier):
        assert courier.battery() > 50

    @pytest.mark.fault("low_battery", charge=0.15)
    def test_a_fault_shows(self, courier):
        assert courier.battery() in range(10, 16)


class TestArm:
    def test_it_drives_by_text(self, robot_server, arm):
        assert arm.say("chassis move x 0.3 wait_for_complete true") == "ok"
        assert far(robot_server, 0.3, 0.0) < 0.1

    def test_it_turns_to_the_right(self, robot_server, arm):
        assert arm.say("chassis move z 45 wait_for_complete true") == "ok"
        assert math.degrees(robot_server.moved().yaw) == pytest.approx(-45, abs=4)

    def test_it_knows_its_battery(self, arm):
        assert int(arm.say("robot battery ?")) > 50

    def test_it_refuses_what_it_does_not_know(self, arm):
        assert arm.say("chassis fly z 3") != "ok"


class TestPrograms:
    def test_blocks_run_in_order(self, program):
        run = program.run("cyberdog.task.block('a');\nprint('hello')\ncyberdog.task.block('b');\n")
        assert (run.blocks, run.printed) == (["a", "b"], ["hello"])

    def test_a_broken_program_is_refused(self, program):
        with pytest.raises(AssertionError):
            program.run("this is no program\n")
