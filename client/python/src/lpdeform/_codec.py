"""meshoptimizer's vertex codec from the system's library (Debian: libmeshoptimizer2d), which the server uses, too."""

from __future__ import annotations

import ctypes
import ctypes.util
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from lpdeform.errors import Code, make


@cache
def _decoder() -> Any:
    name = ctypes.util.find_library("meshoptimizer")
    if name is None:
        return None
    try:
        decode = ctypes.CDLL(name).meshopt_decodeVertexBuffer
    except (OSError, AttributeError):
        return None
    decode.restype = ctypes.c_int
    decode.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    return decode


def require_decoder() -> None:
    """Raises an error if compressed frames cannot be read on this system."""
    if _decoder() is None:
        raise make(
            Code.UNIMPLEMENTED,
            "Compressed frames need the library meshoptimizer, which this system does not have (Debian: libmeshoptimizer2d).",
            "NO_DECODER",
            "encoding",
            "float64, float32 or quantized",
        )


def decompress(block: bytes, count: int) -> npt.NDArray[np.uint16] | None:
    """Four 16-bit integers for each of `count` vertices; None if the block cannot be decoded."""
    decode = _decoder()
    if decode is None:
        return None
    out = np.empty((count, 4), "<u2")
    if decode(out.ctypes.data, count, 8, block, len(block)) != 0:
        return None
    return out
