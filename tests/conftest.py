"""Settings for all tests: examples are the same in every run, and a slow machine is no failure."""

from hypothesis import HealthCheck, settings

settings.register_profile("same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("explore", deadline=None, max_examples=1000)  # scripts/test --hypothesis-profile explore
settings.load_profile("same")
