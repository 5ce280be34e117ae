"""How sure the parameters of a plant are together, and what that makes of its response."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.base.json_object import numbers, or_none, whole
from identification.model.plant import PlantModel

CONFIDENCE = 0.95

Matrix = tuple[tuple[float, ...], ...]
"""Its rows, p of p numbers."""


@dataclass(frozen=True)
class Covariance:
    """Of theta, the p parameters of a plant in their order: logarithms of their magnitudes, but the dead time as it is.

    Parameters
    ----------
    noise, misfit
        By residuals that are noise, and by residuals that are not but what the structure leaves.
    scatter
        Of the mean of tests that differ by more than their noise; it contains the noise. None for other tests.
    freedom
        Of the residuals of all tests, real numbers less parameters.
    count
        Number of tests.
    """

    noise: Matrix
    misfit: Matrix
    scatter: Matrix | None
    freedom: int
    count: int

    def half_widths(self, rows: ArrayLike) -> Real:
        """Half widths (n,) of the 95 % intervals of rows (n, p) times theta, by Student's distribution.

        The distribution is Student's since noise and scatter are estimated.
        """
        from scipy.special import stdtrit  # as long to import as all that a model needs otherwise

        def errors(covariance: Matrix) -> Real:
            at = np.asarray(rows, dtype=float)
            return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ni->n", at @ np.asarray(covariance), at), 0.0)))

        usual = stdtrit(self.freedom, (1 + CONFIDENCE) / 2)
        random = usual * errors(self.noise)
        if self.scatter is not None:
            random = np.maximum(random, stdtrit(self.count - 1, (1 + CONFIDENCE) / 2) * errors(self.scatter))
        return np.asarray(np.hypot(random, usual * errors(self.misfit)))

    def of_response(self, plant: PlantModel, omega: Real) -> tuple[Real, Real]:
        """Half widths (n,) of the 95 % intervals of log |P| and of the phase of P, in rad, at omega (n,) in rad/s.

        They are those of each frequency by itself, to first order in the parameters.
        """
        rows = log_derivatives(plant, omega)
        return self.half_widths(rows.real), self.half_widths(rows.imag)

    def to_dict(self) -> dict[str, Any]:
        """The ``covariance`` of what a fit writes."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], size: int) -> Covariance:
        """Read what :meth:`to_dict` writes of ``size`` parameters; raises InputError when it is of another form."""

        def matrix(of: Mapping[str, Any], key: str) -> Matrix:
            rows = of.get(key)
            found = tuple(numbers({key: row}, key) for row in rows) if isinstance(rows, list) else ()
            if [len(row) for row in found] != [size] * size:
                raise InputError(f"'{key}' is not a matrix; expected {size} rows of {size} numbers")
            return found

        freedom, count = whole(content, "freedom"), whole(content, "count")
        scatter = or_none(matrix)(content, "scatter")
        if freedom < 1 or count < 1 + (scatter is not None):
            least = 1 + (scatter is not None)
            raise InputError(f"'freedom' is {freedom} and 'count' {count}; expected at least 1 and {least}")
        return cls(matrix(content, "noise"), matrix(content, "misfit"), scatter, freedom, count)


def log_derivatives(plant: PlantModel, omega: Real) -> Complex:
    """Derivatives (n, p) of log P(j omega) with respect to theta, see :class:`Covariance`, at omega (n,) in rad/s."""
    s = 1j * omega
    columns = [np.ones_like(s)]
    for modes, side in ((plant.zero_modes, 1), (plant.pole_modes, -1)):
        for mode in modes:
            x = s / mode.omega
            columns += [-2 * side * (mode.zeta + x) * x / mode(s), 2 * side * mode.zeta * x / mode(s)]
    for rates, side in ((plant.real_zeros, 1), (plant.real_poles, -1)):
        columns += [-side * s / (rate + s) for rate in rates]
    return np.stack([*columns, -s], axis=-1)
