"""Each printed transfer function, as a function of frequency, is the computed one within what its digits allow."""

from collections.abc import Callable

import numpy as np
import printed_functions as printed_text
import pytest
from printed_functions import FAST_PAIR, PrintedFunction

from data.thesis import model_named, printed_numbers
from design.anti_windup.compensator import second_order
from design.blocks.block import Block
from design.chapter_2.internal_model import internal_model
from design.chapters_3_4.smith_predictor import anti_windup_controller, augmented_plant
from design.design_file import Design
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel

GRID = 1j * np.union1d(np.geomspace(0.05, 5000, 500), [175.0, 280.0, 282.0, 930.0, 960.0])
SLOW = 1j * np.geomspace(0.05, 30, 200)
ROUNDING = 1e-9  # 30625 lies exactly at the end of what 3.062e4 allows


def delay_free_blocks(plant: PlantModel) -> dict[str, Block]:
    """G_A, theta1 and theta2 of section 2.4."""
    chosen = printed_numbers()["delay_free"]
    units = internal_model(plant, [2 * np.pi / chosen["reference"]["period_s"]], chosen["epsilon"])
    kind = second_order(chosen["alpha"], chosen["beta"], chosen["gamma"])
    return {
        "G_A_2": units.G_A,
        "THETA1": kind.theta1_tilde * units.one_plus_F,
        "THETA2": kind.theta2(plant.without_delay()),
    }


def excess(text: PrintedFunction, exact: Callable[[np.ndarray], np.ndarray], s: np.ndarray) -> np.ndarray:
    """|exact/printed - 1| - allowance, where the digits bound the function at all."""
    allowance = text.allowance(s)
    bounded = allowance < 1
    assert np.mean(bounded) > 0.95
    assert np.median(allowance) < 0.02
    return (np.abs(exact(s) / text(s) - 1) - allowance)[bounded]


@pytest.mark.parametrize("name", ["G_A_2", "THETA1", "THETA2"])
def test_chapter_2(name: str, implied: IdentifiedModel):
    block = delay_free_blocks(implied.plant)[name]
    assert np.all(excess(getattr(printed_text, name), block, GRID) <= ROUNDING)


@pytest.mark.parametrize("name", ["G_A_2", "THETA1", "THETA2"])
def test_chapter_2_does_not_follow_from_table_2_1(name: str):
    block = delay_free_blocks(model_named("table").plant)[name]
    assert np.max(excess(getattr(printed_text, name), block, GRID)) > 0.01


@pytest.mark.parametrize("name", ["C0", "K0", "K1"])
def test_chapter_4(name: str, extended_design: Design):
    assert np.all(excess(getattr(printed_text, name), extended_design.blocks[name], GRID) <= ROUNDING)


def test_chapter_4_F(extended_design: Design):
    """The printed dead time is 8.1e-3 s, the computed one that of the plant."""
    block = extended_design.blocks["F"]
    assert block.delay_s == 8.1e-3
    assert np.all(excess(printed_text.F, block.without_delay(), GRID) <= ROUNDING)


def rest_of_one_plus_F(T_so: Block, delay_s: float, omega: float) -> Callable[[np.ndarray], np.ndarray]:
    """The pair that 1 + F has beside s^2 (s^2 + omega^2)/((s + 4)^2 (s + 1)^2), with the dead time as Pade has it."""
    up = np.array([delay_s**2 / 12, delay_s / 2, 1.0])
    down = np.array([delay_s**2 / 12, -delay_s / 2, 1.0])
    numerator = np.polysub(np.polymul(np.poly(T_so.poles), up), T_so.gain * np.polymul(np.poly(T_so.zeros), down))
    pair, remainder = np.polydiv(numerator, [1.0, 0.0, omega**2, 0.0, 0.0])
    # Pade keeps the double zero at s = 0 but moves the one at j omega, by its error there
    assert np.max(np.abs(remainder)) < 1e-8
    return lambda s: np.polyval(np.real(pair), s) / np.polyval(up, s)


def pade_error(T_so: Block, delay_s: float, s: np.ndarray) -> np.ndarray:
    """|T_so (exp(-T_d s) - Pade)|/|1 + F|: what the approximation changes in 1/(1 + F)."""
    x = delay_s * s
    exact, pade = np.exp(-x), (1 - x / 2 + x**2 / 12) / (1 + x / 2 + x**2 / 12)
    return np.abs(T_so(s) * (exact - pade) / (1 - T_so(s) * exact))


@pytest.mark.parametrize("name", ["G_A_4", "C_AW"])
def test_chapter_4_over_one_plus_F(name: str, extended_design: Design, implied: IdentifiedModel):
    """G_A and C_aw are the printed functions times two factors that the thesis leaves out.

    One is the plant's (930, 960) pair, or its inverse; the other is what is left of 1 + F.
    """
    plant, T_so, K = implied.plant, extended_design.blocks["T_so"], extended_design.blocks["K"]
    text: PrintedFunction = getattr(printed_text, name)
    rest = rest_of_one_plus_F(T_so, plant.delay_s, extended_design.reference_omegas[0])

    def exact(s: np.ndarray) -> np.ndarray:
        if name == "G_A_4":
            return augmented_plant(plant, T_so, s) * np.exp(plant.delay_s * s)
        return anti_windup_controller(plant, K, T_so, s)

    pair = FAST_PAIR(SLOW) if name == "G_A_4" else 1 / FAST_PAIR(SLOW)
    allowance = text.allowance(SLOW) + FAST_PAIR.allowance(SLOW)
    allowance = allowance * (1 + allowance) + 1.01 * pade_error(T_so, plant.delay_s, SLOW) + ROUNDING
    bounded = text.allowance(SLOW) < 1
    assert np.mean(bounded) > 0.95
    ratio = exact(SLOW) / text(SLOW)
    assert np.all((np.abs(ratio * rest(SLOW) / pair - 1) <= allowance)[bounded])
    # neither factor can be spared
    for partial in (ratio, ratio * rest(SLOW), ratio / pair):
        assert np.all((np.abs(partial - 1) > 2 * allowance)[bounded & (allowance < 0.005)])


def test_plant_4_8_is_the_implied_one_but_for_285(implied: IdentifiedModel):
    """With the printed 285 the plant is not the one behind the other transfer functions; with 282 it is."""
    s = 1j * np.array([100.0, 282.0, 285.0, 400.0])

    def printed_plant(omega_d1: float) -> PlantModel:
        zeros = (Mode(175.0, 0.016 / 2), Mode(930.0, 0.08 / 2))
        return PlantModel(7.1, zeros, (Mode(omega_d1, 0.04 / 2), Mode(960.0, 0.21 / 2)), 8.1e-3)

    error_282, error_285 = (np.abs(printed_plant(omega)(s) / implied.plant(s) - 1) for omega in (282.0, 285.0))
    assert np.all(error_282 < 0.03)
    assert error_285[1] > 0.4
    assert error_285[2] > 0.4


def test_allowance_is_that_of_the_worst_rounding():
    """Move every coefficient of one factor to the end of its interval: the allowance holds and is reached."""
    text = PrintedFunction("2.0", ((1, "3.0"),), ((1, "5.0"),))
    s = np.array([0.5 + 0j])
    worst = 2.05 * (0.5 + 3.05) / (0.5 + 4.95)
    assert worst / text(s).real - 1 == pytest.approx(text.allowance(s), rel=1e-12)
