"""Loads all modules that a trial needs; imported by the process from which trials are forked."""

import roboglot.testing.scenarios.runner  # noqa: F401 - for those that are forked from here
from roboglot.shards.warm_up import warm

warm()
