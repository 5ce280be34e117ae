"""The inner and the outer factor of a plant: what no controller can invert, and what a controller may invert."""

from __future__ import annotations

from design.blocks.block import Block, plant_block
from identification.model.plant import PlantModel


def inner_outer(plant: PlantModel) -> tuple[Block, Block]:
    """P = T_si P_o with the inner factor T_si = B exp(-h s) and P_o without zeros in Re s > 0, Thesis Eq. (3.19).

    Returns
    -------
    T_si, P_o
        B is the Blaschke product of the plant's zeros z with Re z > 0, prod(1 - s/z)/(1 + s/conj(z)), which is 1 at
        s = 0 and has the magnitude 1 on the imaginary axis; P_o has the zeros -conj(z) in their place. For a plant
        without such zeros T_si is the dead time alone, as in the thesis.
    """
    P, zeros = plant_block(plant), plant.right_zeros
    B = Block((-1.0) ** len(zeros), zeros, tuple(-zero.conjugate() for zero in zeros))
    return Block(B.gain, B.zeros, B.poles, plant.delay_s), P.without_delay() * B.inverse()
