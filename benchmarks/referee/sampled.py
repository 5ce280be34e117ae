"""Sampled loops beside a plain simulation of their difference equations, the plant by matrix exponentials."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from benchmarks.referee.cases import Case, Finding
from benchmarks.referee.factors import Factors, Real, loop_of, of_block
from benchmarks.referee.loop import another
from benchmarks.referee.realised import System, realised
from experiments.drive.sampled_loop import Drive, simulate_sampled

SAMPLES = 250
SAME = 1e-8  # of the largest value so far: both are exact but for rounding, which unstable controllers amplify
TIE = 1e-7  # of a quantum: nearer to the middle of two levels than this rounding decides between them


def check(case: Case) -> list[Finding]:
    """One run with a drive of its own: either method, levels or none, slew or none, late or not."""
    design, random = case.design, case.random(15)
    name = str(random.choice(["none", "thesis", "corrected"]))
    kind = None if name == "none" else design.compensator(name)
    plant = another(design.loop_plant, random) if random.random() < 0.3 else None
    rate = case.slow * float(10 ** random.uniform(1.0, 3.5))
    limit = case.limit
    drive = Drive(
        rate_hz=rate,
        method=str(random.choice(["tustin", "exact"])),
        limits=(-limit, limit),
        quantum=limit / 500 if random.random() < 0.3 else 0.0,
        rate_limit=limit * rate * float(10 ** random.uniform(-2, 0)) if random.random() < 0.3 else math.inf,
        input_delay_s=float(random.choice([0.0, 1.0, random.uniform(0, 3)])) / rate,
    )
    found = simulate_sampled(design, case.reference, kind, drive, (SAMPLES - 0.5) / rate, plant, form="thesis")
    loop = loop_of(design, plant)
    theta = Factors(0.0) if kind is None else of_block(kind.theta1_tilde)
    theta2 = Factors(0.0) if kind is None else (loop.model * of_block(kind.one_plus)).reduced()
    blocks = [loop.forward, loop.feedback, theta, theta2]
    reference = case.reference
    parts = zip(reference.amplitudes, reference.omegas, reference.phases_rad, strict=True)
    r = reference.offset + sum(a * np.sin(w * found.time_s + p) for a, w, p in parts)
    y, u, given = _simulated(blocks, loop.plant, loop.delay_s, loop.true_delay_s, drive, np.asarray(r))
    pairs = {"u": (u, found.control), "y": (y, found.output), "actuator": (given, found.saturated_control)}
    findings = []
    for what, (own, theirs) in pairs.items():
        known = np.isfinite(own)
        size = (
            np.maximum(np.maximum.accumulate(np.abs(own[known])), 1e-10 * np.abs(own[known]).max(initial=0.0)) + 1e-300
        )
        apart = np.abs(own[known] - theirs[known]) / size
        findings.append(Finding(f"{what} ({drive.method})", float(apart.max()), SAME))
    return findings


@dataclass
class _Sampled:
    """x[k+1] = A x[k] + b i[k], o[k] = c x[k] + d i[k], which a dead time delays; and the past."""

    system: System
    delay_s: float
    T: float
    method: str

    def __post_init__(self) -> None:
        A, b, c, d = self.system
        n, T = len(b), self.T
        if self.method == "tustin":
            left = np.eye(n) - A * T / 2
            self.A = np.linalg.solve(left, np.eye(n) + A * T / 2)
            self.b = np.linalg.solve(left, b * T)
            self.c = np.linalg.solve(left.T, c)
            self.d = d + float(c @ np.linalg.solve(left, b)) * T / 2
        else:
            self.A, self.b = held(A, b, T)
            self.c, self.d = c, d
        samples = self.delay_s / T
        self.whole = math.floor(samples + 1e-9)
        self.rest = samples - self.whole if samples - self.whole > 1e-9 else 0.0
        self.x = np.zeros(n)
        self.past: list[float] = []
        if self.method == "exact" and self.rest:
            ahead, into = held(A, b, (1 - self.rest) * T)
            self.between = (c @ ahead, float(c @ into) + d)

    @property
    def direct(self) -> float:
        """What of the input reaches the delayed output at once."""
        if self.whole > 0 or (self.method == "exact" and self.rest):
            return 0.0
        return self.d * (1 - self.rest)

    def known(self) -> float:
        """The delayed output but for what the present input adds by :attr:`direct`."""
        k = len(self.past)

        def at(back: int) -> float:
            if back == 0:
                return float(self.c @ self.x)
            return self.past[k - back] if k >= back else 0.0

        if self.method == "exact" and self.rest:
            return at(self.whole + 1)
        return (1 - self.rest) * at(self.whole) + (self.rest * at(self.whole + 1) if self.rest else 0.0)

    def take(self, given: float) -> None:
        """The present input."""
        if self.method == "exact" and self.rest:
            row, through = self.between
            self.past.append(float(row @ self.x) + through * given)
        else:
            self.past.append(float(self.c @ self.x) + self.d * given)
        self.x = self.A @ self.x + self.b * given


def held(A: Real, b: Real, length: float) -> tuple[Real, Real]:
    """exp(A t) and the integral of exp(A t) b."""
    n = len(b)
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = A * length, b * length
    whole = expm(M)
    return whole[:n, :n], whole[:n, n]


def _simulated(
    blocks: list[Factors], plant: Factors, delay_s: float, true_delay_s: float, drive: Drive, r: Real
) -> tuple[Real, Real, Real]:
    """y, u and the actuator's output at the samples; not a number from a tie between two levels on."""
    T = 1 / drive.rate_hz
    low, high = drive.limits
    delays = (0.0, delay_s, 0.0, delay_s)
    forward, feedback, theta, theta2 = (
        _Sampled(realised(of), late, T, drive.method) for of, late in zip(blocks, delays, strict=True)
    )
    motor = _Motor(drive, plant, drive.input_delay_s + true_delay_s)
    y, u, given = np.full(len(r), np.nan), np.full(len(r), np.nan), np.full(len(r), np.nan)
    for k in range(len(r)):
        y[k] = motor.output(k * T)
        fed, y_d = feedback.known(), theta2.known()
        before = feedback.direct
        # v = base - slope u~, u = v - theta's known - theta's direct u~
        base = (forward.known() + forward.d * (r[k] - y[k] - y_d) + fed) / (1 - before)
        slope = forward.d * theta2.direct / (1 - before)
        u_0, rise = base - theta.known(), slope + theta.direct
        beyond = u_0 - min(max(u_0, low), high)
        u_tilde = beyond / (1 + rise)
        u[k] = u_0 - rise * u_tilde
        command = min(max(u[k], low), high)
        if drive.quantum:
            share = command / drive.quantum
            if abs(abs(share - math.floor(share)) - 0.5) < TIE:
                y[k:], u[k:] = np.nan, np.nan
                break
            command = (
                min(max(round(share), math.ceil(low / drive.quantum - 1e-9)), math.floor(high / drive.quantum + 1e-9))
                * drive.quantum
            )
        forward.take(r[k] - y[k] - y_d - theta2.direct * u_tilde)
        feedback.take(base - slope * u_tilde)
        theta.take(u_tilde)
        theta2.take(u_tilde)
        motor.command(k * T, command)
        if not abs(u[k]) < 1e60:
            break
    reached = int(np.isfinite(u).sum())
    for k in range(reached):
        given[k] = motor.actuator(k * T - drive.input_delay_s)
    return y, u, given


class _Motor:
    """The actuator on its own time, straight lines and rests, and the plant behind it, read ``late`` seconds later."""

    def __init__(self, drive: Drive, plant: Factors, late: float) -> None:
        self.A, self.b, self.c, _ = realised(plant)
        self.slew, self.late = drive.rate_limit, late
        low, high = drive.limits
        self.rest = min(max(0.0, low), high)
        self.pieces: list[tuple[float, float, float]] = []  # from a time on: value there, slope
        self.time, self.x = 0.0, np.zeros(len(self.b))
        self.place = self.rest

    def command(self, time: float, value: float) -> None:
        """From ``time`` on the actuator goes to this value."""
        start = self.actuator(time, before=True)
        if math.isinf(self.slew) or value == start:
            self.pieces.append((time, value, 0.0))
        else:
            self.pieces.append((time, start, math.copysign(self.slew, value - start)))
            self.pieces.append((time + abs(value - start) / self.slew, value, 0.0))

    def actuator(self, time: float, before: bool = False) -> float:
        """Its output at a time; ``before``: drop what a command at this time replaces."""
        if before:
            while self.pieces and self.pieces[-1][0] > time:
                self.pieces.pop()
        tick = 1e-9 * abs(time) if not before else 0.0
        last = None
        for piece in reversed(self.pieces):
            if piece[0] <= time + tick:
                last = piece
                break
        return self.rest if last is None else last[1] + last[2] * max(0.0, time - last[0])

    def output(self, time: float) -> float:
        """y at a time: the plant is carried up to ``late`` before it."""
        until = time - self.late
        while self.time < until:
            ahead = [piece for piece in self.pieces if piece[0] > self.time]
            end = min(until, ahead[0][0]) if ahead else until
            now = [piece for piece in self.pieces if piece[0] <= self.time]
            value, slope = (now[-1][1] + now[-1][2] * (self.time - now[-1][0]), now[-1][2]) if now else (self.rest, 0.0)
            n, length = len(self.b), end - self.time
            M = np.zeros((n + 2, n + 2))
            M[:n, :n], M[:n, n], M[n, n + 1] = self.A * length, self.b * length, 1.0
            step = expm(M)
            self.x = step[:n, :n] @ self.x + step[:n, n] * value + step[:n, n + 1] * slope * length
            self.time = end
        return float(self.c @ self.x)
