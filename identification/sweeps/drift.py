"""The drift that a record's ends leave in its spectrum: a double integrator flies off, an encoder's ends are noisy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.base.arrays import Complex, Real, Whole
from identification.sweeps.local_models import ORDER, unexplained, windows_of

EVIDENT = 30.0  # of its variance: the square of a drift that is taken off; one that is not there moves the lowest lines
ORDERS = ORDER, 2 * ORDER  # of the response in short and in long windows
REWEIGHTED = 6  # times: the noise of a window is known when the drift is


@dataclass(frozen=True)
class Drift:
    """What the record's ends add to the output's spectrum, k of the two kinds in :func:`find_drift`.

    Parameters
    ----------
    columns
        (L, k) spectra of drifts of size 1.
    size
        (k,) how much of each is there.
    covariance
        (k, k) of the errors of ``size``.
    misfit
        -2 log likelihood of the windows without the drift, up to a constant.
    """

    columns: Complex
    size: Real
    covariance: Real
    misfit: float

    def none(self) -> Drift:
        """No drift."""
        return replace(self, columns=self.columns[:, :0], size=self.size[:0], covariance=self.covariance[:0, :0])


def find_drift(difference: Complex, u: Complex, y: Complex, looks: Sequence[Sequence[Whole]], samples: int) -> Drift:
    """Find a/(1 - 1/z) + b/(1 - 1/z)^2, with real a and b, in the output's spectrum.

    Parameters
    ----------
    difference
        (L,) the factor 1 - 1/z of each line.
    u, y
        (L,) spectra of input and output.
    looks
        The lines in short windows and in long ones, each (C, W).
    samples
        Of the record.

    Notes
    -----
    The transient of a record has the plant's poles. Those at z = 1 reach over all lines: an output that ends elsewhere
    than it began adds a, one whose slope differs at the ends adds b. First differences leave no more of a than the
    noise of two samples, and b only where the plant has two integrators.

    The input of a sweep is so smooth that a response in a short window can hardly be told from b. A long window tells
    them apart, if a quartic is the response in it: what it says must agree with the short windows. Of a and b together,
    a alone, and neither, the first that is evident is taken.

    References
    ----------
    Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., section 6.3.2.
    """
    for kinds in (2, 1, 0):
        columns = difference[:, None] ** -np.arange(1.0, kinds + 1)
        short, long = (
            _likeliest(columns, u, y, tiles, order, samples) for tiles, order in zip(looks, ORDERS, strict=True)
        )
        apart = long.size - short.size
        agree = kinds > 0 and apart @ np.linalg.solve(short.covariance, apart) < EVIDENT
        drift = Drift(columns, long.size, long.covariance, short.misfit) if agree else short
        if not kinds or drift.size[-1] ** 2 > EVIDENT * drift.covariance[-1, -1]:
            return drift
    raise AssertionError


def _likeliest(columns: Complex, u: Complex, y: Complex, tiles: Sequence[Whole], order: int, samples: int) -> Drift:
    """The likeliest size of the drifts if the noise of each window is what a response of ``order`` and they leave."""
    kinds = columns.shape[1]
    spectra = np.concatenate([columns, y[:, None]], axis=1)
    left = [
        unexplained(group, spectra[tile], order) for group, tile in zip(windows_of(tiles, u, y), tiles, strict=True)
    ]
    rounding = [np.finfo(float).eps ** 2 * np.sum(np.abs(y[tile]) ** 2, axis=1) for tile in tiles]
    size, covariance = np.zeros(kinds), np.zeros((kinds, kinds))
    for _ in range(REWEIGHTED):
        information, moment, misfit = np.zeros((kinds, kinds)), np.zeros(kinds), 0.0
        levels = []
        for part, least in zip(left, rounding, strict=True):
            rest = part[..., kinds] - part[..., :kinds] @ size
            freedom = rest.shape[1] - order - 1
            noise = (np.sum(np.abs(rest) ** 2, axis=1) + least + np.finfo(float).tiny) / freedom
            products = 2 * np.einsum("cwi,cwj,c->ij", part[..., :kinds].conj(), part, 1 / noise).real
            information, moment = information + products[:, :kinds], moment + products[:, kinds]
            levels.append(noise)
            misfit += 2 * freedom * float(np.sum(np.log(noise)))
        if kinds:  # a is that of the noise of two samples
            information[0, 0] += samples / (2 * float(np.median(np.concatenate(levels))))
        scale = 1 / np.sqrt(np.diag(information))
        covariance = np.linalg.pinv(information * scale[:, None] * scale) * scale[:, None] * scale
        size = covariance @ moment
    return Drift(columns, size, covariance, misfit)
