"""Names of the array types that signatures use."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
"""Numbers."""
Complex = NDArray[np.complex128]
"""Complex numbers."""
