"""What the corrected anti-windup gives for what it is asked: f over recovery time and sector (Fig. A.1)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from design.anti_windup.compensator import second_order
from design.anti_windup.condition import PositiveReal, Sector
from design.anti_windup.corrected_compensator import SETTLED, corrected
from design.anti_windup.judge import judge
from design.anti_windup.thesis_compensator import least_f
from design.blocks.block import plant_block
from design.design_file import Design
from identification.base.errors import InputError

SECTORS = (0.9, 0.95, 0.99, 1.0)  # 1: positive real
RECOVERIES = 12  # recovery times, from the fastest that the bandwidth leaves room for
CLOSEST = 0.1  # of the fastest, from it to the next one: f bends there


def trade_off_tables(design: Design, tick: Callable[[], object] = lambda: None) -> dict[str, pd.DataFrame]:
    """The least f found of the corrected class over recovery times and sectors, and the design's own in it.

    Parameters
    ----------
    design
        Its plant, W_a and the bandwidth of its corrected anti-windup count.
    tick
        Called once for each compensator that was looked for.

    Returns
    -------
    dict
        ``trade_off``: sector, recovery_s, f (empty where nothing meets the sector), bandwidth. ``trade_off_summary``: a
        row for thesis, least (the best found of (2.23) within the bandwidth), corrected: f, popov_sector (empty: any),
        recovery_s, lasting_offset (of a windup of 1; empty: it grows), fastest (rad/s, of the poles of theta1~).
    """
    bandwidth, own = design.corrected.bandwidth, design.corrected.judgement.recovery_s
    bound = design.additive_bound
    unstable = plant_block(design.plant).unstable_poles
    rows = []
    fastest = 3 * np.log(1 / SETTLED) / bandwidth
    for recovery_s in fastest + np.append(0.0, np.geomspace(CLOSEST * fastest, 5 * own - fastest, RECOVERIES - 1)):
        for sector in SECTORS:
            try:
                condition = Sector(sector) if sector < 1 else PositiveReal()
                f = corrected(unstable, bound, float(recovery_s), condition, bandwidth).f
            except InputError:  # nothing meets the sector
                f = np.nan
            rows.append((sector, recovery_s, f, bandwidth))
            tick()
    alpha, beta, gamma, _ = least_f(bound, bandwidth)
    kinds = {
        "thesis": design.compensator("thesis"),
        "least": second_order(alpha, beta, gamma),
        "corrected": design.compensator("corrected"),
    }
    summary = [
        {"run": name, "fastest": max(map(abs, kind.one_plus.poles))} | vars(judge(design.plant, bound, kind))
        for name, kind in kinds.items()
    ]
    columns = ["run", "f", "popov_sector", "recovery_s", "lasting_offset", "fastest"]
    return {
        "trade_off": pd.DataFrame(rows, columns=["sector", "recovery_s", "f", "bandwidth"]),
        "trade_off_summary": pd.DataFrame(summary)[columns].astype({"popov_sector": float, "lasting_offset": float}),
    }
