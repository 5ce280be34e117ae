"""Write the SYNTHETIC elevation sweeps: raw records, analyser responses and the plants behind them.

The hardware records of the thesis are not published. This script makes six stand-ins: each test is a plant near
the set ``implied`` of thesis/thesis.toml, driven by the sweep of section 2.4 and recorded with noise. One seed, no
clock, fixed formats: two runs write the same bytes. Run ``python data/make_elevation_sweeps.py``.

Notes
-----
*Excitation.* 5 V sine, 10 to 200 Hz, frequency linear in time (7.3 Hz/s). The two ends of the band are held for half
a second while the amplitude fades in and out along a C-infinity step, so that the band's edges are excited as well
as its middle. 4.5 s of silence follow; the slowest pole mode decays at 4.6 1/s or faster and is excited in the
sixth second, so that the record ends at rest.

*Response.* The input is laid out at 4096 Hz with zeros up to 64 s. Its DFT is multiplied by P(j omega) with the exact
dead time and by 1 - exp(-j omega dt), which takes away the integrator's pole at 0; the inverse DFT is the step from
sample to sample of the continuous response, and its running sum the response. This is exact up to rounding and the
input's spectrum beyond 2048 Hz, 3e-11 of its peak. :func:`check_response` integrates the differential equations of
test 1 by DOP853 at rtol 1e-12 over the first seconds and raises if the two differ by more than 1e-9 of the peak
(measured: 3e-11, over the first 4 s and over all 28 s alike).

*Sampling.* Every eighth sample, 512 Hz = 2.56 * 200 Hz, as an analyser with a 200 Hz span takes. Above 256 Hz the
input's spectrum stays under 3e-6 of that within the band, so the low-pass filter that both channels of an analyser
share would change nothing: the sampled ratio is the continuous-time P(j omega), and no hold is involved.

*Noise.* White, independent, Gaussian on both channels. The output's noise makes the floor of the measured response,
the input's noise its relative error.

*Analyser response.* H1 = sum(Y conj(U))/sum(|U|^2) of the DFTs of the first differences of both channels (their support
is compact, so nothing leaks) over 5 adjacent lines of 1/32 Hz: a resolution of 0.156 Hz. The curvature of P over the
5 lines leaves a bias, at most 0.4 % of P, at the resonance near 45 Hz; at the zero with zeta = 0.008, where P is
nearly a parabola, it is smaller. :func:`averaging_bias` computes it without noise, and the script raises if it comes
to more than 0.35 times the noise of a line (measured: 0.31); the tests' dampings scatter by 10 %. The noise on the
input makes H1 too small by sigma_u^2 N/|U|^2 = 7e-4.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

SEED = 20170801
TESTS = 6
RATE_HZ = 512.0
SAMPLES = 16384
OVERSAMPLING = 8
SWEEP_S = 26.0
FADE_S = 0.5
START_S = 0.5
LINES_AVERAGED = 5
CHECKED_S = 4.0
OUTPUT_NOISE = 3.0e-3  # sd, output units
INPUT_NOISE = 0.10  # sd, V
SPREAD = {"gain": 0.04, "omega": 0.005, "zeta": 0.10, "delay_s": 0.01}  # sd of the logarithm, test to test

HERE = Path(__file__).resolve().parent
OUT = HERE / "elevation"
THESIS = tomllib.loads((HERE / "thesis" / "thesis.toml").read_text(encoding="utf-8"))
EXCITATION = THESIS["excitation"]
NAMES = (
    ["gain"]
    + [f"{kind}_{quantity}_{i}" for kind in ("zero", "pole") for i in (1, 2) for quantity in ("omega", "zeta")]
    + ["delay_s"]
)

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def implied() -> Real:
    """The ten parameters of the set ``implied``, in the order of NAMES."""
    plant = THESIS["plants"]["implied"]
    modes = [mode[key] for kind in ("zero_modes", "pole_modes") for mode in plant[kind] for key in ("omega", "zeta")]
    return np.array([plant["gain"], *modes, plant["delay_s"]])


def draw_plant(rng: np.random.Generator) -> Real:
    """One test's parameters: log-normal around ``implied`` with the standard deviations of SPREAD."""
    spread = [SPREAD[name.split("_")[1] if "_" in name and name != "delay_s" else name] for name in NAMES]
    return implied() * np.exp(np.array(spread) * rng.standard_normal(len(NAMES)))


def mode(x: Complex, omega: float, zeta: float) -> Complex:
    """1 + 2 zeta s/omega + (s/omega)^2 at s = x."""
    return 1 + 2 * zeta * x / omega + (x / omega) ** 2


def plant_times_s(parameters: Real, s: Complex) -> Complex:
    """s P(s), which is finite at s = 0."""
    gain, wn1, zn1, wn2, zn2, wd1, zd1, wd2, zd2, delay = parameters
    zeros = mode(s, wn1, zn1) * mode(s, wn2, zn2)
    return gain * zeros / (mode(s, wd1, zd1) * mode(s, wd2, zd2)) * np.exp(-delay * s)


def smooth_step(x: Real) -> Real:
    """0 below x = 0, 1 above x = 1, infinitely differentiable in between."""
    x = np.clip(x, 1e-9, 1 - 1e-9)
    return 1 / (1 + np.exp(np.clip(1 / x - 1 / (1 - x), -700, 700)))


def excitation(t: Real) -> Real:
    """The sweep in V at times ``t`` in s."""
    start, stop = EXCITATION["start_hz"], EXCITATION["stop_hz"]
    since = np.asarray(t, dtype=float) - START_S
    inside = np.clip(since - FADE_S, 0, SWEEP_S)
    phase = start * np.minimum(since, FADE_S + SWEEP_S) + (stop - start) / (2 * SWEEP_S) * inside**2
    phase += np.maximum(since - FADE_S - SWEEP_S, 0) * stop
    fade = smooth_step(since / FADE_S) * smooth_step((2 * FADE_S + SWEEP_S - since) / FADE_S)
    return EXCITATION["amplitude"] * fade * np.sin(2 * np.pi * phase)


def fine_input() -> Real:
    """The excitation at OVERSAMPLING * RATE_HZ over twice the record."""
    return excitation(np.arange(2 * SAMPLES * OVERSAMPLING) / (OVERSAMPLING * RATE_HZ))


def response(parameters: Real, u: Real) -> Real:
    """The continuous response at the fine samples; see the module's notes."""
    dt = 1 / (OVERSAMPLING * RATE_HZ)
    s = 2j * np.pi * np.fft.rfftfreq(u.size, dt)
    step = np.concatenate([[dt], -np.expm1(-s[1:] * dt) / s[1:]])
    return np.cumsum(np.fft.irfft(np.fft.rfft(u) * plant_times_s(parameters, s) * step, u.size))


def check_response(parameters: Real, y: Real) -> float:
    """Raise unless DOP853 gives the same response; return the largest difference over the peak."""
    gain, wn1, zn1, wn2, zn2, wd1, zd1, wd2, zd2, delay = parameters

    def derivative(t: float, x: Real) -> list[float]:
        # Two biquads (1 + 2 zn s/wn + (s/wn)^2)/(1 + 2 zd s/wd + (s/wd)^2) in series, then gain/s.
        u = float(excitation(np.array(t)))
        q1, v1, q2, v2, _ = x
        a1 = wd1**2 * (u - q1 - 2 * zd1 / wd1 * v1)
        w = q1 + 2 * zn1 / wn1 * v1 + a1 / wn1**2
        a2 = wd2**2 * (w - q2 - 2 * zd2 / wd2 * v2)
        return [v1, a1, v2, a2, gain * (q2 + 2 * zn2 / wn2 * v2 + a2 / wn2**2)]

    samples = np.arange(np.ceil(delay * RATE_HZ), CHECKED_S * RATE_HZ, dtype=int)
    times = samples / RATE_HZ - delay
    solution = solve_ivp(derivative, (0, times[-1]), np.zeros(5), "DOP853", times, rtol=1e-12, atol=1e-14)
    error = float(np.max(np.abs(solution.y[4] - y[samples * OVERSAMPLING])) / np.max(np.abs(y)))
    if not error < 1e-9:
        raise RuntimeError(f"the DFT and DOP853 responses differ by {error:.1e} of the peak")
    return error


def analyser(u: Real, y: Real) -> tuple[Real, Complex, Real]:
    """Frequencies in Hz, H1 and its coherence, averaged over groups of LINES_AVERAGED lines within the sweep."""
    spectra = [np.fft.rfft(np.diff(x), x.size) for x in (u, y)]
    first = int(np.ceil(EXCITATION["start_hz"] * u.size / RATE_HZ))
    last = int(np.floor(EXCITATION["stop_hz"] * u.size / RATE_HZ))
    groups = (last + 1 - first) // LINES_AVERAGED
    lines = first + np.arange(groups * LINES_AVERAGED).reshape(groups, LINES_AVERAGED)
    big_u, big_y = (spectrum[lines] for spectrum in spectra)
    cross = np.sum(big_y * big_u.conj(), axis=1)
    power_u, power_y = (np.sum(np.abs(x) ** 2, axis=1) for x in (big_u, big_y))
    frequency_hz = lines.mean(axis=1) * RATE_HZ / u.size
    return frequency_hz, cross / power_u, np.abs(cross) ** 2 / (power_u * power_y)


def averaging_bias(parameters: Real, u: Real, y: Real) -> float:
    """Largest bias of the noise-free analyser response over the standard deviation of the noisy one, at any line."""
    frequency_hz, measured, _ = analyser(u, y)
    s = 2j * np.pi * frequency_hz
    exact = plant_times_s(parameters, s) / s
    power = np.abs(np.fft.rfft(u)) ** 2
    level = power[np.rint(frequency_hz * u.size / RATE_HZ).astype(int)] * LINES_AVERAGED
    noise = np.sqrt(u.size * (OUTPUT_NOISE**2 + np.abs(exact * INPUT_NOISE) ** 2) / level)
    return float(np.max(np.abs(measured - exact) / noise))


def check_bound(frequency_hz: Real, measured: Complex) -> float:
    """Raise unless the printed bound (2.22) covers |P_implied - measured|; return the largest ratio."""
    s = 2j * np.pi * frequency_hz
    printed = THESIS["additive_bound"]
    bound = printed["gain"] * (1 + s / printed["corner"]) / mode(s, printed["omega"], printed["zeta"])
    ratio = float(np.max(np.abs(plant_times_s(implied(), s) / s - measured) / np.abs(bound)))
    if not ratio < 1:
        raise RuntimeError(f"the printed bound (2.22) misses a test by a factor {ratio:.2f}")
    return ratio


def write(path: Path, about: list[str], columns: dict[str, tuple[str, Real]]) -> None:
    """Write a CSV with '#' header lines; each column comes with its number format."""
    texts = pd.DataFrame({name: [form % x for x in values] for name, (form, values) in columns.items()})
    head = "".join(f"# {line}\n" for line in about)
    path.write_text(head + texts.to_csv(index=False, lineterminator="\n"), encoding="utf-8", newline="\n")


def about(test: int, what: str) -> list[str]:
    """The header of a sweep's file."""
    return [
        f"SYNTHETIC - not measured on hardware. Elevation axis, test {test} of {TESTS}: {what}",
        f"Made by data/make_elevation_sweeps.py with seed {SEED}; licence CC0-1.0; see data/README.md.",
    ]


def main() -> None:
    OUT.mkdir(exist_ok=True)
    fine = fine_input()
    taken = slice(0, SAMPLES * OVERSAMPLING, OVERSAMPLING)
    t = np.arange(SAMPLES) / RATE_HZ
    plants, worst_bias, worst_ratio = [], 0.0, 0.0
    for test in range(1, TESTS + 1):
        rng = np.random.default_rng([SEED, test])
        plants.append(draw_plant(rng))
        fine_output = response(plants[-1], fine)
        if test == 1:
            print(f"DFT response against DOP853: {check_response(plants[-1], fine_output):.1e} of the peak")
        u, y = fine[taken], fine_output[taken]
        worst_bias = max(worst_bias, averaging_bias(plants[-1], u, y))
        u = u + INPUT_NOISE * rng.standard_normal(SAMPLES)
        y = y + OUTPUT_NOISE * rng.standard_normal(SAMPLES)
        frequency_hz, measured, coherence = analyser(u, y)
        worst_ratio = max(worst_ratio, check_bound(frequency_hz, measured))
        write(
            OUT / f"synthetic_test_{test}_raw.csv",
            [
                *about(test, "raw record of a sine sweep."),
                "Units: time_s in s, input in V, output in the plant's output unit.",
            ],
            {"time_s": ("%.6f", t), "input": ("%.5f", u), "output": ("%.6f", y)},
        )
        write(
            OUT / f"synthetic_test_{test}_frf.csv",
            [
                *about(test, "response computed from the raw record."),
                "Units: frequency_hz in Hz, magnitude_db in dB (0 dB is 1 output unit/V), phase_deg in degrees, "
                "coherence 0 to 1.",
            ],
            {
                "frequency_hz": ("%.5f", frequency_hz),
                "magnitude_db": ("%.4f", 20 * np.log10(np.abs(measured))),
                "phase_deg": ("%.3f", np.degrees(np.angle(measured))),
                "coherence": ("%.6f", coherence),
            },
        )
    if not worst_bias < 0.35:
        raise RuntimeError(f"averaging lines leaves a bias of {worst_bias:.2f} times the noise")
    write(
        OUT / "synthetic_truth.csv",
        [
            "SYNTHETIC - the parameters from which each synthetic test was made, one row a test.",
            f"Made by data/make_elevation_sweeps.py with seed {SEED}; licence CC0-1.0; see data/README.md.",
            "Units: gain in output units/(V s), omega in rad/s, zeta without unit, delay_s in s.",
        ],
        {
            "test": ("%d", np.arange(1, TESTS + 1)),
            **{n: ("%.9g", v) for n, v in zip(NAMES, np.array(plants).T, strict=True)},
        },
    )
    print(f"bias of averaging lines: at most {worst_bias:.3f} times the noise of a line")
    print(f"|P_implied - test|: at most {worst_ratio:.3f} times the printed W_a (2.22)")


if __name__ == "__main__":
    main()
