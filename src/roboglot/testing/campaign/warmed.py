"""Loads all modules that a trial needs; imported by the process from which trials are forked.

It ends after its campaign, even after one that was killed, so it deletes the folder in which both have their socket.
"""

import atexit
import os
import shutil

from roboglot.shards.warm_up import warm
from roboglot.testing.campaign.local import FOLDER

atexit.register(shutil.rmtree, os.environ[FOLDER], ignore_errors=True)

import roboglot.testing.scenarios.runner  # noqa: E402, F401 - for those that are forked from here

warm()
