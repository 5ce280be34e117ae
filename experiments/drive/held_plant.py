"""The plant between a D/A and an A/D converter: what it makes of a held input, at the samples, factored."""

from __future__ import annotations

import math

import numpy as np
from flint import acb, arb, arb_mat

from design.blocks.ball import decided
from design.blocks.block import Block, plant_block
from design.blocks.state_space import realize
from design.chapters_3_4.tracking import factored
from experiments.drive.difference_equations import SampledBlock, held, split
from identification.base.arrays import Complex, Real
from identification.base.errors import InputError
from identification.model.plant import PlantModel

BETWEEN = 32  # instants in a sample, and in half a period of the plant's fastest mode
MOST_BETWEEN = 1000


def image(root: complex, sample_time_s: float) -> complex:
    """The root z = exp(s T) in w = (z - 1)/T, which tends to s as T vanishes; rad/s."""
    return complex(np.expm1(complex(root) * sample_time_s)) / sample_time_s


def held_plant(plant: PlantModel, sample_time_s: float, more_delay_s: float = 0.0) -> tuple[Block, int]:
    """What a plant makes of an input that stands still between the samples, exact at the samples.

    Parameters
    ----------
    plant
        P with its dead time.
    sample_time_s
        T, positive.
    more_delay_s
        Between the sample and the input, in addition to the plant's dead time; not negative.

    Returns
    -------
    block, samples
        The pulse transfer function is block(w) z^-samples with w = (z - 1)/T: the block has as many zeros as poles,
        and its poles are the images of the plant's. An output that jumps with the input is sampled before it does.

    Raises
    ------
    InputError
        Two of its zeros are too close to separate.

    Notes
    -----
    With the dead time (whole + rest) T the samples see the state (1 - rest) T after the input was set: the modified
    z-transform. The zeros are found in ball arithmetic, since those that sampling adds may lie far from all others.
    """
    whole, rest = split(plant.delay_s + more_delay_s, sample_time_s)
    P = realize(plant_block(plant))
    n = len(P.b)

    def carried(length: arb) -> tuple[arb_mat, arb_mat]:
        """exp(A length) and its integral's product with b."""
        rows = [[arb(float(number)) * length for number in (*row, into)] for row, into in zip(P.A, P.b, strict=True)]
        found = arb_mat([*rows, [arb(0)] * (n + 1)]).exp()
        return (
            arb_mat([[found[i, j] for j in range(n)] for i in range(n)]),
            arb_mat([[found[i, n]] for i in range(n)]),
        )

    def numerator() -> Block:
        T = arb(sample_time_s)
        ahead, into = carried(T)
        read, stands = carried(T * (1 - arb(rest)))
        c = arb_mat([[arb(float(number)) for number in P.C[0]]])
        through = (c * stands)[0, 0] + arb(float(P.d[0]))
        identity = arb_mat([[arb(int(i == j)) for j in range(n)] for i in range(n)])
        turned = (ahead - identity - into * (c * read) * (1 / through)) * (1 / T)
        return factored((turned.charpoly() * through).coeffs(), 1.0)

    found = decided(numerator) if n else Block(float(P.d[0]))
    if found is None:
        raise InputError(
            f"the zeros of the plant with a held input are too close to separate at {1 / sample_time_s:g} Hz; "
            "expected another rate"
        )
    poles = tuple(image(pole, sample_time_s) for pole in plant_block(plant).poles)
    return found * Block(1.0, (), poles), whole + 1


def late(samples: int, sample_time_s: float, point: acb, terms: int) -> list[acb]:
    """The first Taylor coefficients of z^-samples = (1 + T w)^-samples at a point w; of negative samples too."""
    z, T, factor, found = 1 + arb(sample_time_s) * point, arb(sample_time_s), arb(1), []
    for k in range(terms):
        found.append(factor * z ** (-samples - k) * T**k)
        factor *= arb(-samples - k) / (k + 1)
    return found


def sampled_plant(plant: PlantModel, sample_time_s: float) -> SampledBlock:
    """The plant of :func:`held_plant` as difference equations with one output, whose memory is its dead time."""
    whole, rest = split(plant.delay_s, sample_time_s)
    P = realize(plant_block(plant))
    A, b = held(P, sample_time_s)
    ahead, into = held(P, (1 - rest) * sample_time_s)
    return SampledBlock(
        A=A,
        b=b,
        C=P.C @ ahead,
        d=P.C @ into + P.d,
        first=np.array([whole + 1]),
        length=np.array([1]),
        taps=np.ones((1, 1)),
    )


def between_samples(
    plant: PlantModel, sample_time_s: float, more_delay_s: float, omega: float, output: complex, control: complex | None
) -> tuple[Real, Complex]:
    """The output of a plant with a held input between the samples, in the steady state under a sinusoid.

    Parameters
    ----------
    plant, sample_time_s, more_delay_s
        As of :func:`held_plant`.
    omega
        Of the sinusoid, rad/s.
    output, control
        Complex amplitudes: the output is Re(output exp(j omega t)) at the samples, and so is the control; without
        ``control`` it is found from the output.

    Returns
    -------
    late_s, amplitudes : ndarray, shape (k,)
        From :data:`BETWEEN` instants of a sample on, both ends included: at these times after a sample, some of which
        are negative, the output is Re(amplitude exp(j omega t_sample)).

    Notes
    -----
    With z = exp(j omega T) the state X exp(j omega t_sample) obeys z X = exp(A T) X + (integral of exp(A t) b) V. Where
    the output is given, C X + D V as it is read is a further equation, so that poles of the plant at z do not matter.
    """
    whole, rest = split(plant.delay_s + more_delay_s, sample_time_s)
    P, read = realize(plant_block(plant)), (1 - rest) * sample_time_s
    n, turn = len(P.b), np.exp(1j * omega * sample_time_s)
    (A, b), (ahead, into) = held(P, sample_time_s), held(P, read)
    equations = np.zeros((n + 1, n + 1), dtype=complex)
    equations[:n] = np.column_stack([turn * np.eye(n) - A, -b]) / sample_time_s
    equations[n] = [*P.C[0] @ ahead, P.C[0] @ into + P.d[0]] if control is None else [*np.zeros(n), 1.0]
    state = np.linalg.solve(equations, [*np.zeros(n), output if control is None else control * turn ** -(whole + 1.0)])
    fastest = max([omega, *(abs(pole.imag) for pole in plant_block(plant).poles)])
    count = BETWEEN * min(max(math.ceil(fastest * sample_time_s / math.pi), 1), MOST_BETWEEN // BETWEEN)
    A, b = held(P, sample_time_s / count)
    step = np.block([[A, b[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
    found = []
    for _ in range(count + 1):
        found.append(complex(P.C[0] @ state[:n] + P.d[0] * state[n]))
        state = step @ state
    late_s = np.linspace(0.0, sample_time_s, count + 1) - read
    return late_s, np.array(found)
