"""Still pictures from recorded films."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from roboglot.console.settings import JPEG_QUALITY
from roboglot.extras import explaining
from roboglot.media.stills import jpeg
from roboglot.model.components.sensing.camera import Frame
from roboglot.model.errors import NotFound

WIDTH = 640  # pixels

with explaining("pictures of recordings", "video"):
    import av


def last_picture(units: Iterable[bytes]) -> bytes:
    """Return the last picture of some access units (H.264), the first of which is a key picture, as a small JPEG.

    Raises NotFound. Takes up to 0.1 s: call it in a thread.
    """
    codec, found = av.VideoCodecContext.create("h264", "r"), None
    codec.thread_count = 1  # more threads delay pictures
    for unit in units:
        try:
            found = [found, *codec.decode(av.Packet(unit))][-1]
        except av.FFmpegError:
            continue  # a damaged one; what follows may be whole
    if found is None:
        raise NotFound("the recording has no picture of this moment")
    height = max(2, round(found.height * WIDTH / found.width / 2) * 2)
    small = found.reformat(width=WIDTH, height=height, format="yuv420p")
    return jpeg(Frame(0.0, np.ascontiguousarray(small.to_ndarray(), np.uint8)), JPEG_QUALITY)
