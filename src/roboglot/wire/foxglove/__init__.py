"""Messages of the Foxglove WebSocket protocol, for both ends. Knows no robot and no socket."""
