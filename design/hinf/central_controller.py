"""The controller of greatest entropy of a mixed sensitivity problem, from its interpolation problem."""

from __future__ import annotations

from collections.abc import Sequence

from flint import acb, acb_mat, acb_poly, arb_poly, ctx

from design.blocks.ball import UndecidedError, decided, in_x, mirrored, polynomial_roots, reflected, shared
from design.blocks.block import Block
from design.hinf.pick import Problem, Setting, level_of, nu_of, orders_of, pick_matrix, setting_of, values_of


def central_controller(problem: Problem, gamma: float) -> Block | None:
    """The controller of greatest entropy among those that bring the norm below gamma.

    Parameters
    ----------
    problem
        What is minimised.
    gamma
        A norm that some controller reaches.

    Returns
    -------
    Block or None
        None where rounding errors are too large at every precision that is tried.

    Notes
    -----
    With P the Pick matrix and P a = e the interpolant of greatest entropy is

        E = sum(a_l/(s + conj(s_l)))/(1 + sum(conj(e_l) a_l/(s + conj(s_l)))),

    and K = T/(1 - T)/G; what cancels in it by construction is divided out before the roots are found. A point that is
    repeated has the next Taylor coefficients, in conj(s_l), of 1/(s + conj(s_l)) and conj(E(s_l))/(s + conj(s_l)). It
    is the central controller of the two Riccati equations (K. Glover and J. C. Doyle, Systems & Control Letters 11
    (1988) 167-172).
    """
    return decided(lambda: _central_controller(setting_of(problem, ctx.prec), problem, gamma))


def _central_controller(setting: Setting, problem: Problem, gamma: float) -> Block:
    level = level_of(setting, gamma)
    nu = nu_of(level, polynomial_roots(level))
    points, values = setting.points, values_of(setting, nu)
    count = len(points)
    matrix = acb_mat(count, count, [entry for row in pick_matrix(points, values) for entry in row])
    try:
        weights = matrix.solve(acb_mat(count, 1, values)).entries() if count else []
    except ZeroDivisionError as error:
        raise UndecidedError(str(error)) from None
    full = acb_poly([1])
    for s in points:
        full *= acb_poly([s.conjugate(), 1])
    orders = orders_of(points)
    kernels = [
        (-1) ** order * (full // acb_poly([s.conjugate(), 1]) ** (order + 1))
        for s, order in zip(points, orders, strict=True)
    ]
    above, below = acb_poly([0]), full
    for k, (weight, order) in enumerate(zip(weights, orders, strict=True)):
        above += weight * kernels[k]
        for i in range(order + 1):
            below += weight * values[k - order + i].conjugate() * kernels[k - i]
    E_numerator, E_denominator = _real(above), _real(below)

    d1, d2, nc = setting.d1, setting.d2, setting.nc
    T = E_numerator * d1 * nu + nc * in_x(setting.n1_squared) * mirrored(d2) * E_denominator
    S = nc * in_x(setting.n2_squared) * mirrored(d1) * E_denominator - E_numerator * d2 * nu
    T //= _from_points(setting.zeros) * in_x(setting.N)
    S //= _from_points(setting.poles) * in_x(setting.N)
    return _block(setting, problem, T, S)


def _block(setting: Setting, problem: Problem, T: arb_poly, S: arb_poly) -> Block:
    """K = T/(S G) d_2/d_1 in rad/s."""
    G, x = problem.G, setting.line
    _, d1, d2 = shared(problem.W1.poles, problem.W2.poles)
    images, _, d1 = reflected(G.poles, d1, x.decay_rate)  # E is zero at such a pole of G, and T at its image
    T //= x.polynomial(images)
    d2 = [root if root.real < -x.decay_rate else complex(-2 * x.decay_rate - root.real, root.imag) for root in d2]
    zeros, poles = ([root for root in roots if root.real <= -x.decay_rate] for roots in (G.zeros, G.poles))
    own_zeros, own_poles = ([x.back(root) for root in polynomial_roots(factor)] for factor in (T, S))
    K = Block(1.0, (*d2, *poles, *own_zeros)) * Block(1.0, (), (*d1, *zeros, *own_poles))  # equal numbers cancel
    gain = T[T.degree()] / S[S.degree()] / x.gain(G)
    return K.scaled(float(gain / x.gain(K)))


def _from_points(points: Sequence[acb]) -> arb_poly:
    """prod(x - point); the points are closed under conjugation."""
    product = acb_poly([1])
    for point in points:
        product *= acb_poly([-point, 1])
    return _real(product)


def _real(polynomial: acb_poly) -> arb_poly:
    """A polynomial with real coefficients whose arithmetic was complex."""
    return arb_poly([coefficient.real for coefficient in polynomial.coeffs()])
