"""The ports and lines of the text protocol besides the one for commands: events, media, pilot, broadcast, serial.

Each moves bytes between a socket or terminal and the session; none of them knows a command.
"""
