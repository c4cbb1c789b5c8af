"""Asyncio clients of the vendors' protocols, one folder each: usable on their own against real robots and our doors.

Made of ``roboglot.wire``; they know sockets, but neither a robot model's components nor a door.
"""
