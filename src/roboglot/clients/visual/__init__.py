"""The client's end of the block programs' WebSocket."""

from roboglot.clients.visual.texts import TextLink

__all__ = ["TextLink"]
