"""An independent check of the modes from the raw record, by a subspace method; the only importer of sippy_unipi."""

from __future__ import annotations

import contextlib
import io
import warnings
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigvals

from identification.base.arrays import Complex, Real
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.pulse_response import pulse_zeros
from identification.model.reports import ModeCheck, SubspaceCheck

if TYPE_CHECKING:
    from identification.sweeps.response import Record


OVERSAMPLED = 5.0  # sampling frequency over the band's upper end that is kept
LEAD = 2  # whole intervals of dead time that are left to the model, were the fit's too long
MARGIN = 8  # states beyond the plant's and those intervals', for the noise and for filters before the converters
LARGEST_ORDER = 40
HORIZON, NARROWEST = 3, 2  # past and future rows, in orders, and how many more than the order they are at least
SAMPLES = 10  # a row
HELD = 1_000_000  # numbers of past or future rows: the method's time and memory grow with them
NEAR = 0.1  # of omega, within which a mode of one model is taken for that of the other


def check_modes(plant: PlantModel, record: Record, band_omega: tuple[float, float]) -> SubspaceCheck:
    """Compare the plant's oscillating modes with those of a state-space model identified from the record alone.

    Parameters
    ----------
    plant
        The fit to check. The model takes from it how many states to look for and the whole intervals of dead time,
        by which the channels are aligned; and the aliases of a held input move a zero by what they move the fit's.
    record
        Input and output.
    band_omega
        Lower and upper end of the excited band, rad/s.

    Returns
    -------
    SubspaceCheck
        Whatever happens: where the method fails or is not installed, the reason.

    Notes
    -----
    The record is decimated to OVERSAMPLED times the band, both channels by the same filter without phase, differenced
    once for each integrator, and given to N4SID. Of a long one, pieces as long as HELD allows are added up, both
    channels with the same signs: by superposition the sum is a record of the same plant, and it has the frequencies of
    all pieces. A pole z of the sampled system is one at log(z)/T of the plant's, whether the input is held or
    band-limited. So are, nearly, the zeros of a band-limited record; for a held one see
    :func:`identification.model.pulse_response.pulse_zeros`.

    Without noise the modes of held sweeps come back to 1e-5. On the six shipped records (synthetic, band-limited, 2.56
    samples to a period of the band's end) omega came within 0.2 % of the record's own truth and zeta within 6 %,
    its smallest, 0.008, among them. An ARX model of as many states missed zeta by a factor of 6, one with twenty
    poles by 22 %: its least squares are biased by noise on the output.

    References
    ----------
    Van Overschee, De Moor, "Subspace Identification for Linear Systems", 1996, chapter 4.
    """
    factor = max(1, int(2 * np.pi / record.sampling_s / (OVERSAMPLED * band_omega[1])))
    sampling_s = factor * record.sampling_s
    late = max(0, int(plant.delay_s / sampling_s) - LEAD)
    differences = max(0, plant.integrators)
    order = differences + 2 * len(plant.pole_modes) + len(plant.real_poles) + LEAD + 1 + MARGIN
    samples = max(0, record.input.size // factor - late - differences)
    horizon = min(HORIZON * order, samples // SAMPLES)
    if order > LARGEST_ORDER:
        return SubspaceCheck(order, sampling_s, (), f"expected a plant that needs {LARGEST_ORDER} states or fewer")
    if horizon < order + NARROWEST:
        least = SAMPLES * (order + NARROWEST)
        after = f" after the dead time of {late}" if late else ""
        reason = f"the record has {samples} samples of {sampling_s:.3g} s{after}; expected {least} or more"
        return SubspaceCheck(order, sampling_s, (), reason)
    if find_spec("sippy_unipi") is None:
        return SubspaceCheck(order, sampling_s, (), 'sippy-unipi is missing; pip install "antiwindup-thesis[check]"')
    try:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            u, y = (_decimated(x, factor, differences) for x in (record.input, record.output))
            u, y = (_added_up(x, HELD // horizon) for x in (u[: u.size - late], y[late:]))
            A, B, C, D = _state_space(u, y, order, horizon)
            pencil = np.block([[A, B], [C, D]]), np.diag([1.0] * order + [0.0])
            found = {"zero": _s_plane(eigvals(*pencil), sampling_s), "pole": _s_plane(eigvals(A), sampling_s)}
            images = pulse_zeros(plant, record.sampling_s) if record.held else None
    except (Exception, SystemExit) as error:
        return SubspaceCheck(order, sampling_s, (), f"{type(error).__name__}: {error}".strip(": "))
    checks = [_nearest("zero", mode, found["zero"], images) for mode in plant.zero_modes]
    checks += [_nearest("pole", mode, found["pole"], None) for mode in plant.pole_modes]
    inside = [check for check in checks if abs(check.zeta) < 1 and band_omega[0] <= check.omega <= band_omega[1]]
    return SubspaceCheck(order, sampling_s, tuple(inside))


def _decimated(x: Real, factor: int, differences: int) -> Real:
    """Decimated without phase, and differenced."""
    from scipy.signal import resample_poly  # most of a second, and only raw records need it

    slow = resample_poly(x, 1, factor, padtype="line") if factor > 1 else x
    return np.asarray(np.diff(slow, n=differences))


def _added_up(x: Real, longest: int) -> Real:
    """The sum of equal pieces of ``x`` with signs by chance, lest periods cancel; no mean, standard deviation 1."""
    pieces = -(-x.size // longest)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], pieces)
    total = signs @ x[: x.size // pieces * pieces].reshape(pieces, -1)
    return np.asarray((total - total.mean()) / total.std())


def _state_space(u: Real, y: Real, order: int, horizon: int) -> tuple[Real, Real, Real, Real]:
    """A, B, C, D by sippy, which takes Python integers only."""
    import sippy_unipi  # more than a second, and only raw records need it

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


def _nearest(kind: str, mode: Mode, found: Complex, images: Complex | None) -> ModeCheck:
    """The root of ``found`` next to the mode, or to the mode's own image, by whose distance it is then moved."""
    wanted = max(mode.roots, key=lambda root: root.imag)
    image = wanted if images is None else complex(images[np.argmin(np.abs(images - wanted))])
    distance = np.abs(found - image)
    if not found.size or distance.min() > NEAR * mode.omega:
        return ModeCheck(kind, mode.omega, mode.zeta, None, None)
    root = complex(found[np.argmin(distance)]) - image + wanted
    return ModeCheck(kind, mode.omega, mode.zeta, abs(root), -root.real / abs(root))
