"""A positive real 1 + theta1~: its condition by closed forms, its least f and its certificate by cvxpy."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from design.__main__ import main
from design.anti_windup.chosen_guarantee import chosen_guarantee, why_not_global
from design.anti_windup.compensator import from_one_plus
from design.anti_windup.condition import PositiveReal, Robustness, Sector, is_positive_real
from design.anti_windup.corrected_compensator import corrected
from design.anti_windup.judge import compensators
from design.anti_windup.kyp_certificate import Rows, certificate, proved_storage
from design.blocks.block import Block, bound_block
from design.chapters_3_4.design_extended import design_extended
from design.design_file import Design, read_design
from identification.base.errors import InputError
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

OMEGA = np.geomspace(1e-2, 1e5, 20001)
WASHOUT = Block(1.0, (0j,), (-3 + 0j,))
LAG = Block(1.0, (-5 + 0j,), (-2 + 0j,))
NOTCH = Block(1.0, (0j, -0.5 + 6j, -0.5 - 6j), (-1 + 0j, -7 + 0j, -7 + 0j))


def rational(x: Block) -> Robustness:
    return Robustness(lambda omega: np.abs(x(1j * omega)), x.zeros + x.poles, x)


def test_positive_real_by_its_closed_form() -> None:
    """s (s + c)/(s + 1)^2 has Re M |d|^2 = omega^2 (omega^2 - 1 + 2 c)."""
    for c, expected in ((np.nextafter(0.5, 1.0), True), (0.5, False), (0.4, False), (2.0, True)):
        assert is_positive_real(Block(1.0, (0j, complex(-c)), (-1 + 0j, -1 + 0j))) == expected
    assert not is_positive_real(Block(1.0, (0j, 0j), (-1 + 0j, -2 + 0j)))
    assert not is_positive_real(Block(1.0, (1 + 0j,), (-1 + 0j,)))
    assert not is_positive_real(Block(1.0, (-1 + 0j,), (1 + 0j,)))
    assert is_positive_real(Block(1.0))


@pytest.mark.parametrize("searched", [False, True])
def test_the_robust_condition_by_its_closed_form(searched: bool) -> None:
    """|arg (s + a)/(s + b)| has the maximum arcsin |b - a|/(b + a), and x/(1 - x) has to stay below its cosine."""
    kind = from_one_plus(LAG)
    loss = np.sqrt(1 - (3 / 7) ** 2)
    for share, expected in ((1 - 1e-6, True), (1 + 1e-6, False)):
        robustness = rational(Block(share * loss / (1 + share * loss)))
        if searched:
            robustness = dataclasses.replace(robustness, rational=None)
        assert PositiveReal(robustness).holds(kind) == expected


def test_where_x_reaches_one_half_nothing_is_left() -> None:
    shape = rational(Block(0.6, (), (-1 + 0j,)))
    for given in (shape, dataclasses.replace(shape, rational=None)):
        with pytest.raises(InputError, match=r"\|W_a C S\| reaches 0\.6 at (0|0\.001) rad/s; expected less than 1/2"):
            PositiveReal(given)


@pytest.fixture(scope="module")
def robust_design(implied: IdentifiedModel) -> Design:
    return design_extended(implied, [1.5], 4.0, [(2.0, 1.0)], robust_level=0.4, guarantee="robust")


def test_the_default_is_global_and_robust_costs_more(extended_design: Design, robust_design: Design) -> None:
    own, robust = extended_design.corrected, robust_design.corrected
    assert (own.guarantee, own.sector, robust.guarantee) == ("global", None, "robust")
    assert own.guarantee_said.endswith("proved in exact arithmetic")
    assert own.judgement.f == pytest.approx(0.0640, abs=1e-4)  # 0.0639 is the limit of sectors that tend to 1
    for found in (own, robust):
        assert found.f_lower <= found.judgement.f <= 1.01 * found.f_lower
        M = found.kind.one_plus
        real = M(1j * OMEGA).real * (1 + (M.poles[0].real / OMEGA) ** 2)
        assert real.min() > 0
    assert robust.judgement.f > own.judgement.f
    s = 1j * OMEGA
    x = np.abs(robust_design.additive_bound(s) * robust_design.blocks["K"](s))
    M = robust.kind.one_plus(s)
    assert np.all(M.real > np.abs(M) * x / (1 - x))
    assert not np.all(own.kind.one_plus(s).real > np.abs(own.kind.one_plus(s)) * x / (1 - x))


@pytest.mark.parametrize("robust", [False, True])
def test_the_least_f_is_that_of_a_convex_program(implied: IdentifiedModel, robust: bool) -> None:
    """The same poles, cones of second order in place of half planes, by cvxpy."""
    import cvxpy as cp

    share = Block(0.4, (0j,), (-20 + 0j,)) if robust else Block(0.0)
    condition = PositiveReal(rational(share) if robust else None)
    found = corrected((0j,), implied.additive_bound, 1.15, condition, 960.0, False)
    poles = np.array(found.anti_windup.one_plus.poles)
    omega = np.concatenate([np.geomspace(0.04, 1e5, 300), np.linspace(275, 285, 200)])
    s, unit = 1j * omega, 280.0
    d = np.prod((s[:, None] - poles) / unit, axis=1)
    basis = np.stack([(s / unit) ** k / d for k in (1, 2, 3)])
    n = cp.Variable(2)
    M = n @ basis[:2] + basis[2]
    W_a = bound_block(implied.additive_bound)(s)
    scale = 1 + (poles[0].real / omega) ** 2
    loss = np.abs(share(s)) / (1 - np.abs(share(s)))
    cost = cp.norm_inf(cp.multiply(np.abs(W_a), cp.abs(M)))
    program = cp.Problem(
        cp.Minimize(cost), [cp.multiply(scale, cp.real(M)) >= cp.multiply(scale * loss, cp.abs(M)) + 1e-6]
    )
    program.solve(solver=cp.CLARABEL)
    assert program.value <= found.f * (1 + 1e-3)
    assert found.f <= 1.01 * program.value


def test_what_falls_below_zero_between_two_frequencies_is_solved_more_tightly() -> None:
    modes = (Mode(1.22, 0.00131), Mode(112.0, 0.0525), Mode(266.0, 0.425))
    bound = AdditiveBound(0.00381, (), modes, (74.8, 9430.0, 633.0, 1.7, 4350.0, 293.0), (30900.0, 88400.0))
    found = corrected((), bound, 5.0, PositiveReal(), 246.0, False)
    assert found.f_lower <= found.f <= 1.001 * found.f_lower  # 1.0097 without


SLOW_AND_FAST = Block(
    1.0,
    (0j, -0.64167 + 42.122j, -0.64167 - 42.122j, -219.91 + 0j, -1155.8 + 0j),
    (-0.15790 + 0j, *(complex(-104.72),) * 4),
)


@pytest.mark.parametrize(
    "M", [WASHOUT, LAG, NOTCH, SLOW_AND_FAST, Block(1.0)], ids=["washout", "lag", "notch", "slow and fast", "one"]
)
def test_the_certificate_dissipates(M: Block) -> None:
    """2 x'P (A x + b u~) <= 2 u~ (C x + u~) for any x and u~, and C, A, b are M's."""
    storage = proved_storage(M, certificate(M))
    n = len(storage.b)
    for s in (0.3j, 2 + 5j):
        response = 1 + storage.C @ np.linalg.solve(s * np.eye(n) - storage.A, storage.b) if n else 1.0
        assert response == pytest.approx(complex(M(s)), rel=1e-9)
    rng = np.random.default_rng(0)
    x, u = rng.standard_normal((2000, n)), rng.standard_normal(2000) * 10 ** rng.uniform(-2, 2, 2000)
    grows = 2 * np.einsum("si,ij,sj->s", x, storage.P, x @ storage.A.T + np.outer(u, storage.b))
    supplied = 2 * u * (x @ storage.C + u)
    assert np.all(grows <= supplied + 1e-9 * (np.abs(grows) + np.abs(supplied)))
    assert np.all(storage.value(x) >= 0)


def test_poles_far_apart_have_a_certificate() -> None:
    """Of any positive real M with one slow pole and fast ones, or with all of them drawn, over five decades."""
    rng = np.random.default_rng(1)
    proved = 0
    while proved < 40:
        n = int(rng.integers(2, 7))
        rates = np.sort(10 ** np.append([-1.0, 4.0], rng.uniform(-1, 4, n - 2)))
        if rng.random() < 0.5:
            rates[1:] = rates[-1]
        pair = rates[-1] * 10 ** rng.uniform(-1, 0.3) * np.exp(1j * rng.uniform(1.6, 3.1))
        zeros = [0, *(-rates[1:] * 10 ** rng.uniform(-1, 0.3, n - 1))]
        if n > 2 and rng.random() < 0.7:
            zeros[-2:] = [pair, pair.conjugate()]
        M = Block(1.0, tuple(map(complex, zeros)), tuple(map(complex, -rates)))
        if is_positive_real(M):
            storage, proved = proved_storage(M, certificate(M)), proved + 1
            dissipated = storage.A.T @ storage.P + storage.P @ storage.A
            assert np.linalg.eigvalsh(dissipated).max() < 0


def test_a_certificate_that_rounding_spoils_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("design.anti_windup.kyp_certificate.solve_continuous_lyapunov", lambda *_: -np.eye(1) / 3)
    with pytest.raises(InputError, match="the certificate of the anti-windup does not"):
        certificate(WASHOUT)


def test_the_certificate_of_a_washout_is_the_only_one() -> None:
    storage = proved_storage(WASHOUT, certificate(WASHOUT))
    assert pytest.approx(1 / 3, rel=1e-15) == storage.P
    assert storage.steepness == pytest.approx(np.sqrt(3), rel=1e-12)


@pytest.mark.filterwarnings("ignore:Solution may be inaccurate")
def test_the_certificate_has_the_least_steepness() -> None:
    """Of all P that the linear matrix inequality of the KYP lemma allows, by cvxpy."""
    import cvxpy as cp

    storage = proved_storage(NOTCH, certificate(NOTCH))
    P = cp.Variable((3, 3), symmetric=True)
    A, C = storage.A, storage.C
    program = cp.Problem(
        cp.Minimize(cp.matrix_frac(C, P)),
        [P @ np.ones(3) == np.linalg.solve(A.T, C), A.T @ P + P @ A << -1e-4 * np.eye(3)],
    )
    program.solve(solver=cp.CLARABEL)
    assert storage.steepness**2 == pytest.approx(program.value, rel=1e-4)


@pytest.mark.parametrize(
    "M",
    [Block(1.0, (0j, -0.4 + 0j), (-1 + 0j, -1 + 0j)), Block(1.0, (0j, 0j), (-1 + 0j, -2 + 0j))],
    ids=["not", "twice"],
)
def test_what_is_not_positive_real_has_no_certificate(M: Block) -> None:
    with pytest.raises(InputError, match="is not positive real; expected Re M > 0"):
        certificate(M)


def scaled(rows: Rows, factor: float) -> Rows:
    return tuple(tuple(factor * value for value in row) for row in rows)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"certificate": lambda rows: scaled(rows, 1.1)}, r"does not meet P A\^-1 b = -\(C A\^-1\)'"),
        ({"certificate": lambda rows: rows[:2]}, "is not a symmetric matrix; expected one with 3 rows"),
        ({"certificate": lambda _: None}, "is 'global'; expected a certificate and no sector beside it"),
        ({"certificate": lambda _: 5}, "'certificate' is 5; expected a list of rows"),
        ({"guarantee": lambda _: "all"}, "guarantee is 'all'; expected one of global, robust, sector"),
        ({"guarantee": lambda _: "sector"}, "is 'sector'; expected a sector and no certificate beside it"),
    ],
)
def test_a_file_whose_certificate_proves_nothing_is_refused(
    extended_design: Design, changes: dict, sentence: str, tmp_path: Path
) -> None:
    content = json.loads(extended_design.to_json())
    own = content["anti_windup"]["corrected"]
    own.update({name: change(own[name]) for name, change in changes.items()})
    (tmp_path / "design.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_design(tmp_path / "design.json")


def test_a_certificate_of_another_compensator_proves_nothing() -> None:
    """M keeps A, C and the equality: only where it is not positive real does the inequality fail."""
    rows = certificate(LAG)
    with pytest.raises(InputError, match="does not prove that 1 \\+ theta1~ is positive real"):
        proved_storage(Block(1.0, (-50 + 0j,), (-2 + 0j,)), rows)
    assert proved_storage(LAG, rows).P.shape == (1, 1)


def test_the_file_keeps_the_guarantee(robust_design: Design, tmp_path: Path) -> None:
    (tmp_path / "design.json").write_text(robust_design.to_json(), encoding="utf-8")
    assert read_design(tmp_path / "design.json").corrected == robust_design.corrected


def test_which_plants_have_a_global_guarantee() -> None:
    assert not any(why_not_global(poles) for poles in ((), (0j,)))
    assert "for 2 integrators 1 + theta1~ falls like s^2" in why_not_global((0j, 0j))
    assert "plant's pole 3 +- 4j rad/s in the right half plane" in why_not_global((0j, 3 + 4j, 3 - 4j))
    name, condition, said = chosen_guarantee((0j, 0j), None, None, None)
    assert (name, condition) == ("sector", Sector(0.95))
    assert "for 2 integrators" in said
    for asked, sector, sentence in (
        ("global", 0.9, "a sector of 0.9 is stated beside the guarantee 'global'; expected no sector"),
        ("best", None, "the guarantee is 'best'; expected one of global, robust, sector"),
        ("robust", None, "of the loop is not known"),
    ):
        with pytest.raises(InputError, match=sentence):
            chosen_guarantee((0j,), asked, sector, None)
    with pytest.raises(InputError, match="the guarantee is 'global', but no guarantee for every control exists"):
        chosen_guarantee((0j, 0j), "global", None, None)


def test_the_command_takes_a_guarantee(tmp_path: Path) -> None:
    output = tmp_path / "design.json"
    options = ["extended", "implied", "--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1"]
    options += ["--output", str(output), "--guarantee"]
    refused = CliRunner().invoke(main, [*options, "robust"])
    assert refused.exit_code == 2
    assert "|W_a C S| reaches 8.84 at 175 rad/s; expected less than 1/2 for a robust guarantee" in refused.output
    assert not output.exists()
    result = CliRunner().invoke(main, [*options, "robust", "--robust-level", "0.3"])
    assert result.exit_code == 0, result.output
    assert "guarantee of the corrected one: robust, for every plant within W_a with as many poles in" in result.output
    assert read_design(output).corrected.guarantee == "robust"


def test_a_plant_without_integrator_keeps_the_smaller_f() -> None:
    """theta1~ = 0 is positive real; another M of the class is taken where its f is smaller."""
    bound = AdditiveBound(0.02, (), (Mode(30.0, 0.05),), (), ())
    found = corrected((), bound, 2.0, PositiveReal(), 60.0)
    assert found.f < 0.5 * bound_block(bound).gain * 30.0**-2 / (2 * 0.05)
    flat = corrected((), AdditiveBound(0.02, (), (), (20.0,), (20.0,)), 2.0, PositiveReal(), 60.0)
    assert flat.anti_windup.one_plus == Block(1.0)


def test_no_pole_goes_beyond_what_was_measured(implied: IdentifiedModel) -> None:
    bound = dataclasses.replace(implied.additive_bound, real_poles=(6e4,))

    def bandwidth(own_s: float, highest: float | None) -> float:
        return compensators(implied.plant, bound, own_s, highest_omega=highest)[1].bandwidth

    assert bandwidth(1.0, None) == pytest.approx(6e4)
    assert bandwidth(1.0, 500.0) == 500.0
    assert bandwidth(1e-3, 500.0) == pytest.approx(np.log(100) / 1e-3)  # the loop itself is faster


def test_a_plant_of_two_integrators_is_designed_for_a_sector() -> None:
    plant = PlantModel(3.0, (), (), 0.01, integrators=2)
    own = compensators(plant, AdditiveBound.printed_form(0.01, 5.0, 40.0, 0.1), 1.0)[1]
    assert (own.guarantee, own.sector, own.certificate) == ("sector", 0.95, None)
    assert "for 2 integrators" in own.guarantee_said
