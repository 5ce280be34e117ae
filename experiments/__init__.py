"""Designs -> saturated closed loops with an exact dead time -> the tables behind every figure."""

import hashlib
import os
import sys
from pathlib import Path

# numba looks only at the module of a compiled function for changes, not at those that it calls into: a cache for each
# state of them all, unless the user has one
_texts = [path.read_bytes() for path in sorted(Path(__file__).parent.rglob("*.py"))]
_digest = hashlib.sha256(b"".join(text for text in _texts if b"njit" in text)).hexdigest()[:16]
if "NUMBA_CACHE_DIR" not in os.environ:
    os.environ["NUMBA_CACHE_DIR"] = str(Path(__file__).parent / "__pycache__" / f"numba-{_digest}")
    if "numba" in sys.modules:  # which has read its environment already
        sys.modules["numba"].config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]
