"""Control of the robots of a running ``roboglot up``: lease, stop, reset. ``running.py`` asks any running program."""
