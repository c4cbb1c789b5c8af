"""The console: pages and an interface over which people see, drive and understand robots in a browser.

Sees robots, the world's stage and the tap; knows no door's insides and no simulation.
"""
