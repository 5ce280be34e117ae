"""The model fitted from the shipped sweeps, from which `make figures` starts by default."""

from __future__ import annotations

import numpy as np
from strict import Strict

from data.thesis import THESIS
from identification.fitting.fit_plant import fit_plant
from identification.sweeps.read_sweeps import read_sweeps


def test_default_model(strict_snapshot: Strict) -> None:
    tests = read_sweeps(sorted((THESIS.parent / "elevation").glob("*_frf.csv")))
    result = fit_plant(tests)
    plant = result.plant
    modes = [*plant.zero_modes, *plant.pole_modes]
    strict_snapshot(
        "default_model",
        {
            "gain": np.array([plant.gain]),
            "delay_s": np.array([plant.delay_s]),
            **{f"omega_{k}": np.array([mode.omega]) for k, mode in enumerate(modes)},
            **{f"zeta_{k}": np.array([mode.zeta]) for k, mode in enumerate(modes)},
            **{f"error_{k}": np.array([error]) for k, error in enumerate(result.nominal.errors)},
        },
    )
