"""What the thesis says of its simulated runs: the PID benchmark, the chapter 2 loop and the chapter 4 loop."""

from __future__ import annotations

import numpy as np

from design.extended import design_extended
from experiments.claims_inputs import Inputs, plant_of
from experiments.extended import extended_tables
from experiments.metrics import over_last
from experiments.pid import STEP, pid_tables
from identification.model import read_model
from identification.plant import PlantModel
from identification.thesis import printed

RAMP_S = 0.1  # long against the plant's slowest mode, short against the reference's period
WINDOW_S, WINDOW_SAMPLES = 32.0, 2**16  # the plant's modes have died out by then; 0.5 ms


def pid(inputs: Inputs) -> dict[str, float]:
    """The gains of C = P + I/s for which section 2.2 describes the loop, and the overshoot with those printed.

    Without anti-windup Fig. 2.2 has a step response with an overshoot; of the printed gains and the swapped ones
    those are taken that end nearer to the step. The overshoot, in percent, is the one with back-calculation.
    """
    tables = pid_tables()
    runs, summary = tables["pid"], tables["pid_summary"].iloc[0]
    gains = printed()["pid"]["printed_proportional"], printed()["pid"]["printed_integral"]
    time_s = runs["time_s"].to_numpy()
    ripple = {
        name: over_last(time_s, runs[f"output_{name}_none"].to_numpy() - STEP, 20.0)[1]
        for name in ("printed", "swapped")
    }
    proportional, integral = gains if ripple["printed"] < ripple["swapped"] else gains[::-1]
    return {
        "pid.proportional": proportional,
        "pid.integral": integral,
        "pid.overshoot": float(summary["overshoot_printed_back_calculation"]),
    }


def delay_free(inputs: Inputs) -> dict[str, float]:
    """The least tracking error in percent of the amplitude that +-10 at the plant's input allows in chapter 2."""
    chosen = printed()["delay_free"]
    reference = chosen["reference"]
    omega = 2 * np.pi / reference["period_s"]
    least = least_peak_error(plant_of(inputs), chosen["limit"], reference["amplitude"], omega)
    return {"delay_free.tracking_error": 100 * least / reference["amplitude"]}


def extended(inputs: Inputs) -> dict[str, float]:
    """Chapter 4 from rest, under the limits for which the loop without anti-windup saturates until 4 s.

    ``extended.tracking_error``: the largest error after the first second without anti-windup.
    ``extended.recovery_s``: when the loop with the thesis's anti-windup leaves saturation for good.
    """
    chosen = printed()["extended"]
    design = design_extended(
        read_model("implied"), [chosen["reference"]["omega"]], chosen["a"], [(chosen["e"], chosen["f"])]
    )
    summary = extended_tables(design)["extended_summary"].set_index("run")
    return {
        "extended.tracking_error": float(summary["peak_error_after_1s"]["none"]),
        "extended.recovery_s": float(summary["last_saturation_s"]["thesis"]),
    }


def least_peak_error(plant: PlantModel, limit: float, amplitude: float, omega: float) -> float:
    """A lower bound for the peak of |r - y| in every half period, whatever the controller.

    Parameters
    ----------
    plant
        From rest; a dead time makes no difference.
    limit
        |u| <= limit at the plant's input.
    amplitude, omega
        Of the sinusoidal reference, omega in rad/s.

    Notes
    -----
    Let phi be a window around the steepest point of r, rising from 0 to 1 and falling back, and w(tau) the
    integral of phi(t) r_0(t - tau), r_0 being the impulse response of R_0 = P s/K. Then, with e = r - y,

        integral phi r' - K integral w u = integral phi e' = -integral phi' e <= 2 max |e|,

    and integral w u <= limit ||w||_1. The window is as wide as r' exceeds K limit, with edges so smooth that R_0
    hardly changes it: with a sharp window the modes' ringing would make ||w||_1 large and the bound useless.
    """
    slope = abs(plant.gain) * limit
    half_width = np.arccos(min(1.0, slope / (amplitude * omega))) / omega
    step = WINDOW_S / WINDOW_SAMPLES
    time_s = (np.arange(WINDOW_SAMPLES) - WINDOW_SAMPLES // 2) * step
    phase = np.clip((np.abs(time_s) - half_width) / RAMP_S + 0.5, 0, 1)
    window = (1 + np.cos(np.pi * phase)) / 2
    s = 2j * np.pi * np.fft.rfftfreq(WINDOW_SAMPLES, step)[1:]
    R_0 = np.concatenate([[1.0], plant.without_delay()(s) * s / plant.gain])
    weight = np.fft.irfft(np.fft.rfft(window) * R_0, WINDOW_SAMPLES)
    needed = np.sum(window * amplitude * omega * np.cos(omega * time_s)) * step
    return max(0.0, float(needed - slope * np.sum(np.abs(weight)) * step) / 2)
