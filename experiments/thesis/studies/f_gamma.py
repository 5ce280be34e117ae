"""The parameter study of f(gamma) = ||W_a (1 + theta1~)||_inf (Fig. 2.10 and 2.11)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar

from design.anti_windup.compensator import second_order, uncertainty_cost
from design.anti_windup.thesis_compensator import beta_grid, optimal_gamma, thesis_choice
from identification.model.additive_bound import AdditiveBound


def f_gamma_tables(bound: AdditiveBound) -> dict[str, pd.DataFrame]:
    """f over gamma for the four values of beta that the thesis's text allows to identify.

    Parameters
    ----------
    bound
        W_a; alpha = 1/corner as the thesis chooses it.

    Returns
    -------
    dict
        ``f_gamma``: alpha, beta, gamma, f, one row a point. ``f_gamma_summary``: one row; the thesis's choice
        (beta from the coarse grid) and the least f over a continuous beta between alpha/8 and 4 alpha. (With the
        thesis's bound f keeps rising beyond, to 6.5 at beta = 1.)
    """
    alpha, beta, gamma = thesis_choice(bound)
    rows = []
    # gamma > -1 keeps the zeros of 1 + theta1~ stable; a bound without resonance may have its optimum below 0
    gammas = np.linspace(0.0, 3 * gamma, 301) if gamma > 1 else np.linspace(-0.999, 3.0, 301)
    for candidate in beta_grid(alpha):
        for value in np.union1d(gammas, optimal_gamma(bound, alpha, candidate)[0]):
            cost, _ = uncertainty_cost(bound, second_order(alpha, candidate, value).one_plus)
            rows.append((alpha, candidate, value, cost))
    best = minimize_scalar(
        lambda logarithm: optimal_gamma(bound, alpha, float(np.exp(logarithm)))[1],
        bounds=(np.log(alpha / 8), np.log(4 * alpha)),
        method="bounded",
        options={"xatol": 1e-6},
    )
    beta_best = float(np.exp(best.x))
    summary = {
        "alpha": alpha,
        "beta": beta,
        "gamma": gamma,
        "f": optimal_gamma(bound, alpha, beta)[1],
        "beta_best": beta_best,
        "gamma_best": optimal_gamma(bound, alpha, beta_best)[0],
        "f_best": float(best.fun),
    }
    return {
        "f_gamma": pd.DataFrame(rows, columns=["alpha", "beta", "gamma", "f"]),
        "f_gamma_summary": pd.DataFrame([summary]),
    }
