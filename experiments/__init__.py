"""Designs -> saturated closed loops with an exact dead time -> the tables behind every figure."""

import hashlib
import os
import sys
from pathlib import Path

# numba looks only at the module of a compiled function for changes, not at those that it calls into: a cache for each
# state of them all, unless the user has one; in the user's cache folder where the package may not be written to
_room = Path(__file__).parent
_texts = [path.read_bytes() for path in sorted(_room.rglob("*.py"))]
_digest = hashlib.sha256(b"".join(text for text in _texts if b"njit" in text)).hexdigest()[:16]
if "NUMBA_CACHE_DIR" not in os.environ:
    _own, _users = _room / "__pycache__", os.environ.get("XDG_CACHE_HOME", "~/.cache")
    _cache = _own if os.access(_room, os.W_OK) else Path(_users).expanduser() / "antiwindup"
    os.environ["NUMBA_CACHE_DIR"] = str(_cache / f"numba-{_digest}")
    if "numba" in sys.modules:  # which has read its environment already
        sys.modules["numba"].config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]
