"""A small app as anyone might write it: drives a robot by its REST API and its text protocol, knows no roboglot.

python courier.py http://192.168.11.1:1448 1.0 0.5 [seconds of patience]
"""

import json
import socket
import sys
import time
import urllib.error
import urllib.request

MOVE = "slamtec.agent.actions.MoveToAction"
LOW = 20  # percent: below it the robot stays put


class RobotError(Exception):
    """The robot refused, or did not get there."""


class Courier:
    """Drives to places and back, if the battery allows it."""

    def __init__(self, url, patience=170.0):
        self.url, self.patience = url.rstrip("/"), patience

    def ask(self, method, path, body=None):
        """Send one request and return its JSON."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=self.patience) as response:
                text = response.read()
        except urllib.error.HTTPError as error:
            raise RobotError(f"{method} {path}: {error.code} {error.read().decode(errors='replace')}") from None
        except OSError as error:
            raise RobotError(f"{self.url} does not answer: {error}") from None
        return json.loads(text) if text else None

    def battery(self):
        """Percent."""
        return self.ask("GET", "/api/core/system/v1/power/status")["batteryPercentage"]

    def place(self):
        """x, y in the robot's map, m."""
        pose = self.ask("GET", "/api/core/slam/v1/localization/pose")
        return pose["x"], pose["y"]

    def go(self, x, y):
        """Drive there; returns when the robot has arrived."""
        if self.battery() < LOW:
            raise RobotError("the battery is low")
        target = {"target": {"x": x, "y": y, "z": 0}, "move_options": {"mode": 0}}
        action = self.ask("POST", "/api/core/motion/v1/actions", {"action_name": MOVE, "options": target})
        return self._wait(action["action_id"])

    def stop(self):
        """End what it does."""
        self.ask("DELETE", "/api/core/motion/v1/actions/:current")

    def deliver(self, places):
        """Go to each place, then back to where it was; returns how many were reached."""
        home, reached = self.place(), 0
        for x, y in places:
            try:
                self.go(x, y)
                reached += 1
            except RobotError:
                break
        self.go(*home)
        return reached

    def _wait(self, action):
        deadline = time.monotonic() + self.patience
        while time.monotonic() < deadline:
            state = self.ask("GET", f"/api/core/motion/v1/actions/{action}")["state"]
            if state["status"] == 4:
                if state["result"] != 0:
                    raise RobotError(f"not there: {state['reason']}")
                return
            time.sleep(0.05)
        self.stop()
        raise RobotError("not there in time")


class Arm:
    """The few words of the text protocol that the courier needs."""

    def __init__(self, host):
        self.socket = socket.create_connection((host, 40923), timeout=60)
        self.say("command")

    def say(self, text):
        """Send one command and return the answer."""
        self.socket.sendall(f"{text};".encode())
        answer = b""
        while not answer.rstrip().endswith(b";") and len(answer) < 4096:
            part = self.socket.recv(4096)
            if not part:
                break
            answer += part
        return answer.decode().strip(" ;\n")

    def close(self):
        """Hang up."""
        self.socket.close()


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit("courier.py URL X Y [PATIENCE]: drive the robot at URL to X, Y (m) within PATIENCE s")
    courier = Courier(sys.argv[1], *map(float, sys.argv[4:5]))
    try:
        courier.go(float(sys.argv[2]), float(sys.argv[3]))
    except RobotError as error:
        sys.exit(str(error))
    print("arrived at", *(f"{value:.1f}" for value in courier.place()))
