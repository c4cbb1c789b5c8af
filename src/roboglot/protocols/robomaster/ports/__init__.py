"""Ports of the text protocol besides the control port: events, media, pilot, broadcast, serial line.

Each moves bytes between a socket or terminal and the session; none knows a command.
"""
