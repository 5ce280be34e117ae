"""Names of the array types that signatures use."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
"""Numbers."""
Complex = NDArray[np.complex128]
"""Complex numbers."""
Whole = NDArray[np.intp]
"""Whole numbers: indices and counts."""
Flags = NDArray[np.bool_]
"""Yes or no."""
Array = NDArray[Any]
"""An array of any kind."""
