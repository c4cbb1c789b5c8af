"""Asks the Slamware door and the console of this container whether they answer; ends with 1 if one does not."""

from __future__ import annotations

import sys
import urllib.error
import urllib.request

ASKED = (
    "http://127.0.0.1:1448/api/core/system/v1/power/status",
    "http://127.0.0.1:50080/api/robots",
)
for url in ASKED:
    try:
        urllib.request.urlopen(url, timeout=2).close()
    except urllib.error.HTTPError as error:  # it answers: who asks is not let in
        if error.code >= 500:
            sys.exit(f"{url}: {error}")
    except OSError as error:
        sys.exit(f"{url}: {error}")
