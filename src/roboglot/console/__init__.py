"""The console: pages to see, drive and understand robots in a browser, and their interface.

Knows robots, the world's stage and the tap; no internals of doors, no simulation.
"""
