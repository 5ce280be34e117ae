"""The fit of one test from nothing, against scipy's least squares of the same test started at the answer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from identification.fit import fit_plant
from identification.frequency_response import read_sweep
from identification.likelihood import response_of
from identification.model import read_model
from identification.thesis import DATA


def test_against_scipy_from_the_answer(against: Callable[..., object]) -> None:
    test = read_sweep(min((DATA / "elevation").glob("*_frf.csv")))
    plant = read_model("implied").plant
    start = np.array(
        [
            np.log(plant.gain),
            *(np.log(value) for mode in (*plant.zero_modes, *plant.pole_modes) for value in (mode.omega, mode.zeta)),
            plant.delay_s,
        ]
    )
    sigma = 0.01 * np.abs(test.response)

    def residual(theta: np.ndarray) -> np.ndarray:
        return ((response_of(theta, test.omega) - test.response) / sigma).view(float)

    against(lambda: fit_plant([test], modes=2), lambda: least_squares(residual, start, x_scale="jac"))
