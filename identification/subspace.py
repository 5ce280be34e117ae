"""An independent check of the modes from the raw record, by a subspace method; the only importer of sippy_unipi."""

from __future__ import annotations

import contextlib
import io
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sippy_unipi
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigvals
from scipy.signal import resample_poly

from identification.plant import Mode, PlantModel

if TYPE_CHECKING:
    from identification.frequency_response import Record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

OVERSAMPLED = 5.0  # sampling frequency over the band's upper end that is kept
MARGIN = 4  # states beyond the plant's and its dead time's, for what the filters before the converters add
LARGEST_ORDER = 40
HORIZON = 2  # of past and future rows, in orders
LONGEST = 65536  # samples; the method's time and memory grow with them
NEAR = 0.1  # of omega, within which a mode of one model is taken for that of the other


@dataclass(frozen=True)
class ModeCheck:
    """One mode of the plant and the nearest one of the subspace model.

    Parameters
    ----------
    kind
        ``zero`` or ``pole``.
    omega, zeta
        The plant's; rad/s.
    found_omega, found_zeta
        The subspace model's nearest, None where none is within NEAR omega in the s plane.
    """

    kind: str
    omega: float
    zeta: float
    found_omega: float | None
    found_zeta: float | None


@dataclass(frozen=True)
class SubspaceCheck:
    """What a subspace model of the raw record says of the plant's modes.

    Parameters
    ----------
    order
        Number of states.
    sampling_s
        Sampling interval in seconds of the record as it was used.
    modes
        Zero modes, then pole modes; none when there is no answer.
    reason
        Why there is no answer, or None.
    """

    order: int
    sampling_s: float
    modes: tuple[ModeCheck, ...]
    reason: str | None = None

    def __str__(self) -> str:
        if self.reason is not None:
            return f"N4SID of order {self.order}: no answer ({self.reason})"
        words = []
        for mode in self.modes:
            if mode.found_omega is None or mode.found_zeta is None:
                words.append(f"no {mode.kind} near {mode.omega:.5g} rad/s")
            else:
                change = f"{100 * (mode.found_omega / mode.omega - 1):+.2g} %"
                words.append(f"{mode.kind} {mode.found_omega:.5g} rad/s ({change}), zeta {mode.found_zeta:.3g}")
        return f"N4SID of order {self.order}: " + ("; ".join(words) or "the plant has no mode to check")


def check_modes(plant: PlantModel, record: Record, band_omega: tuple[float, float]) -> SubspaceCheck:
    """Compare the plant's oscillating modes with those of a state-space model identified from the record alone.

    Parameters
    ----------
    plant
        The fit to check; of it the method is given only how many states to look for.
    record
        Input and output.
    band_omega
        Lower and upper end of the excited band, rad/s.

    Notes
    -----
    The record is decimated to OVERSAMPLED times the band, both channels by the same filter without phase, differenced
    once for each integrator, and given to N4SID. A pole z of the sampled system is one at log(z)/T of the plant's,
    whether the input is held or band-limited; zeros keep that relation nearly, well below the Nyquist
    frequency and lightly damped. On the six shipped records (synthetic) every frequency comes within 0.4 % of the
    record's own truth and every damping ratio within a fifth.

    References
    ----------
    Van Overschee, De Moor, "Subspace Identification for Linear Systems", 1996, chapter 4.
    """
    factor = max(1, int(2 * np.pi / record.sampling_s / (OVERSAMPLED * band_omega[1])))
    sampling_s = factor * record.sampling_s
    states = plant.integrators + 2 * len(plant.pole_modes) + len(plant.real_poles)
    order = states + int(np.ceil(plant.delay_s / sampling_s)) + MARGIN
    u, y = (_prepared(x, factor, plant.integrators) for x in (record.input, record.output))
    horizon = HORIZON * order
    if order > LARGEST_ORDER:
        return SubspaceCheck(order, sampling_s, (), f"more than {LARGEST_ORDER} states")
    if not 10 * horizon < u.size <= LONGEST:
        return SubspaceCheck(order, sampling_s, (), f"{u.size} samples; expected {10 * horizon} to {LONGEST}")
    try:
        A, B, C, D = _state_space(u / np.std(u), y / np.std(y), order, horizon)
        pencil = np.block([[A, B], [C, D]]), np.diag([1.0] * order + [0.0])
        found = {"zero": _s_plane(eigvals(*pencil), sampling_s), "pole": _s_plane(eigvals(A), sampling_s)}
    except (Exception, SystemExit) as error:
        return SubspaceCheck(order, sampling_s, (), f"{type(error).__name__}: {error}".strip(": "))
    modes = [("zero", mode) for mode in plant.zero_modes] + [("pole", mode) for mode in plant.pole_modes]
    checks = [_nearest(kind, mode, found[kind]) for kind, mode in modes if mode.zeta < 1]
    return SubspaceCheck(order, sampling_s, tuple(checks))


def _prepared(x: Real, factor: int, differences: int) -> Real:
    """Decimated without phase, differenced, and without mean."""
    slow = resample_poly(x, 1, factor, padtype="line") if factor > 1 else x
    slow = np.diff(slow, n=differences)
    return np.asarray(slow - slow.mean())


def _state_space(u: Real, y: Real, order: int, horizon: int) -> tuple[Real, Real, Real, Real]:
    """A, B, C, D by sippy, which prints, warns, exits, and takes Python integers only."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        model = sippy_unipi.system_identification(
            y, u, "N4SID", SS_fixed_order=int(order), SS_f=int(horizon), SS_p=int(horizon), SS_D_required=True
        )
        return model.A, model.B, model.C, model.D


def _s_plane(roots: ArrayLike, sampling_s: float) -> Complex:
    """log(z)/T of the roots with positive imaginary part."""
    z = np.asarray(roots, dtype=complex)
    z = z[np.isfinite(z) & (np.abs(z) > np.finfo(float).eps)]
    s = np.log(z) / sampling_s
    return np.asarray(s[s.imag > 0])


def _nearest(kind: str, mode: Mode, found: Complex) -> ModeCheck:
    wanted = max(mode.roots, key=lambda root: root.imag)
    distance = np.abs(found - wanted)
    if not found.size or distance.min() > NEAR * mode.omega:
        return ModeCheck(kind, mode.omega, mode.zeta, None, None)
    root = complex(found[np.argmin(distance)])
    return ModeCheck(kind, mode.omega, mode.zeta, abs(root), -root.real / abs(root))
