"""Slamtec's Slamware REST API 1.1 from the client's end. Knows sockets and ``wire``, no robot model and no door."""

from roboglot.clients.slamware.calls import SlamwareRefused
from roboglot.clients.slamware.client import SlamwareClient
from roboglot.clients.slamware.running import ActionAborted, ActionFailed, RunningAction

__all__ = ["ActionAborted", "ActionFailed", "RunningAction", "SlamwareClient", "SlamwareRefused"]
