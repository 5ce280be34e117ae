"""The fit of one test from nothing, against scipy's least squares of the same test started at the answer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from data.thesis import THESIS, model_named
from identification.fitting.fit_plant import fit_plant
from identification.fitting.least_squares import response_of
from identification.model.structure import Structure, Wanted
from identification.sweeps.read_sweeps import read_sweeps


def test_against_scipy_from_the_answer(against: Callable[..., object]) -> None:
    test = read_sweeps([min((THESIS.parent / "elevation").glob("*_frf.csv"))])[0]
    plant = model_named("implied").plant
    start = np.array(
        [
            np.log(plant.gain),
            *(np.log(value) for mode in (*plant.zero_modes, *plant.pole_modes) for value in (mode.omega, mode.zeta)),
            plant.delay_s,
        ]
    )
    structure = Structure(1, 4, 4)
    sigma = 0.01 * np.abs(test.response)

    def residual(theta: np.ndarray) -> np.ndarray:
        return ((response_of(structure, theta, test.omega) - test.response) / sigma).view(float)

    against(lambda: fit_plant([test], Wanted(1, (2, 2), (0, 0))), lambda: least_squares(residual, start, x_scale="jac"))
