"""Scenarios: tests in YAML for people who write no Python. A robot starts, an app drives it, the truth judges."""
