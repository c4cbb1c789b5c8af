"""Arrays by the type of their elements, as kernels take and return them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
Int32Array = NDArray[np.int32]
Int16Array = NDArray[np.int16]
Int8Array = NDArray[np.int8]
ByteArray = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]
Uint16Array = NDArray[np.uint16]
Uint32Array = NDArray[np.uint32]
