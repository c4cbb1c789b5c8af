"""Settings for all tests: examples are the same in every run, and a slow machine is no failure."""

import importlib.util
import sys

from hypothesis import HealthCheck, settings

settings.register_profile("same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("explore", deadline=None, max_examples=1000)  # scripts/test --hypothesis-profile explore
settings.load_profile("same")

# httpx's pool tries to import it at every request: a third of a request's time went into looking for what isn't there.
if importlib.util.find_spec("sniffio") is None:
    sys.modules["sniffio"] = None  # type: ignore[assignment]
