"""Single pictures as JPEG."""

from __future__ import annotations

import io

from roboglot.model.components.sensing.camera import Frame


def jpeg(frame: Frame, quality: int = 90) -> bytes:
    """Return ``frame`` as a JPEG file; ``quality`` 1..95. Takes tens of milliseconds: call it in a thread."""
    from PIL import Image

    if not 1 <= quality <= 95:
        raise ValueError(f"a JPEG's quality is 1 to 95, not {quality}")
    file = io.BytesIO()
    Image.fromarray(frame.rgb()).save(file, "JPEG", quality=quality)
    return file.getvalue()
