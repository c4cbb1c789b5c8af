"""Single pictures as JPEG."""

from __future__ import annotations

import io

from roboglot.model.components.sensing.camera import Frame


def jpeg(frame: Frame, quality: int = 90) -> bytes:
    """``frame`` as a JPEG file; ``quality`` 1..95. Takes some tens of milliseconds: do it beside the loop."""
    from PIL import Image

    if not 1 <= quality <= 95:
        raise ValueError(f"a JPEG's quality is 1 to 95, not {quality}")
    file = io.BytesIO()
    Image.fromarray(frame.rgb()).save(file, "JPEG", quality=quality)
    return file.getvalue()
