"""The CyberDog 2 app protocol from the app's end: ``CyberDogClient``. Knows no driver."""

from roboglot.extras import explaining

with explaining("roboglot.clients.cyberdog", "cyberdog"):
    from roboglot.clients.cyberdog.calls import CyberDogRefused, NoAnswer
    from roboglot.clients.cyberdog.client import CyberDogClient
    from roboglot.clients.cyberdog.link import Certificates, Heartbeat
    from roboglot.clients.cyberdog.running import RunningTask, TaskFailed, TaskStopped

__all__ = [
    "Certificates",
    "CyberDogClient",
    "CyberDogRefused",
    "Heartbeat",
    "NoAnswer",
    "RunningTask",
    "TaskFailed",
    "TaskStopped",
]
