"""The RoboMaster EP's text protocol from the client's end: commands, pushes, events, video, sound, discovery.

Speaks the vendor's units, signs and words, and knows neither a robot model nor a driver. See docs/clients.md.
"""
