"""The Foxglove WebSocket protocol's messages, for both ends. Knows no robot and no socket."""
