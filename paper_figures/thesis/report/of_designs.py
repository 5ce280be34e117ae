"""What the page on a plant says of its designs: the table of the simulated loops, and sentences on each design."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan

import pandas as pd

from design.anti_windup.judge import Compensator
from design.design_file import Design
from identification.base.digits import lower_end, upper_end
from paper_figures.look.captions import apart, number, of_run, only, promises, required_input, time_unit
from paper_figures.summary.of_fit import Table

DESIGNS = {"delay_free": "Chapter 2", "extended": "Chapters 3, 4", "robust": "Robust redesign"}
"""Where the thesis has each design."""

FIGURES = {
    "delay_free": "2.12 to 2.14",
    "extended": "4.1 to 4.4",
    "f_gamma": "2.10, 2.11",
    "trade_off": "A.1",
    "interpolation": "A.2",
    "robustness": "A.3",
    "limits_delay_free": "A.4",
    "limits_extended": "A.4",
    "sampled": "A.5",
    "compare": "A.8",
    "campaign": "A.6",
    "hidden_modes": "A.9",
}
"""What is drawn of each experiment that needs a design."""

FOLLOWING = {
    "delay_free": ("delay_free", "limits_delay_free"),
    "extended": (
        *("f_gamma", "extended", "trade_off", "interpolation", "limits_extended", "sampled", "campaign"),
        *("hidden_modes", "compare"),
    ),
    "robust": ("robustness",),
}
"""The experiments that need each design."""

HEAD = (
    "loop",
    "f of (2.19)",
    "Popov sector",
    "theta2",
    "guarantee",
    "last saturated",
    "peak after 1 s",
    "last period's error",
)
RUNS = {"none": "no anti-windup", "thesis": "thesis's anti-windup", "corrected": "corrected anti-windup"}


def loop_table(designs: Mapping[str, Design], tables: Mapping[str, pd.DataFrame]) -> Table | None:
    """A row for each simulated loop: f, Popov sector and theta2 of its anti-windup, its guarantee, and what it does.

    Parameters
    ----------
    designs
        ``delay_free``, ``extended``.
    tables
        What each experiment of the same name summed up.

    Returns
    -------
    Table
        None if nothing was simulated.
    """
    rows = [
        (
            f"{DESIGNS[name]}, {label}",
            *_judgement(designs[name].anti_windup.get(run)),
            _guarantee(tables[name], run),
            *_outcome(tables[name], run),
        )
        for name in designs
        if name in tables
        for run, label in RUNS.items()
    ]
    return Table(HEAD, tuple(rows)) if rows else None


def sentences(design: Design, name: str, tables: Mapping[str, pd.DataFrame]) -> str:
    """What a design is and gives, first of all which anti-windup does harm; and what the tables add."""
    harm = [f"{sentence}. " for sentence in design.compared if "WORSE" in sentence]
    return "".join(harm) + _sentences(design, name, tables)


def _sentences(design: Design, name: str, tables: Mapping[str, pd.DataFrame]) -> str:
    if name == "robust":
        return _redesign(design, tables.get("robustness"))
    if design.hinf is not None:
        said = [
            "For the plant without its dead time",
            f"||[W1 S; W2 T]|| = {upper_end(design.hinf.gamma, 4)}, no stabilising controller below "
            f"{lower_end(design.hinf.gamma_lower, 4)}",
        ]
        if not design.blocks["K"].is_stable:
            said.append("K itself is UNSTABLE and diverges when the actuator saturates")
    else:
        poles = ", ".join(number(pole.real) if not pole.imag else f"{pole:.3g}" for pole in design.blocks["T_so"].poles)
        said = [f"With the exact dead time; poles of T_so {poles}"]
    if name in tables:
        said.insert(0, promises(tables[name]).removesuffix("."))
    thesis, corrected = design.thesis, design.corrected
    guaranteed = "" if corrected.sector is None else f" {number(corrected.sector)}"
    said.append(
        f"theta1~: alpha = {number(thesis.alpha)} s, beta = {number(thesis.beta)} s, gamma = "
        f"{number(thesis.gamma)} by (2.23); corrected, guarantee {corrected.guarantee}{guaranteed}, recovery in "
        f"{number(corrected.judgement.recovery_s)} s"
    )
    if name == "extended" and "f_gamma" in tables:
        said.append(f"The least f of (2.23) found over beta is {number(only(tables['f_gamma'], 'f_best'))}")
    if name in tables:
        omegas = ", ".join(number(omega) for omega in design.reference_omegas)
        said.append(f"The thesis's reference at {omegas} rad/s. {required_input(tables[name])}")
    return ". ".join(said) + "."


def _redesign(design: Design, robustness: pd.DataFrame | None) -> str:
    said, roll_off = "As the design of chapters 3, 4", design.free.roll_off
    if roll_off is not None and roll_off.order:
        said += f", with {roll_off.order} more poles of T_so at {number(roll_off.rate)} rad/s"
    if robustness is None:
        return f"{said}."
    before, after = (number(of_run(robustness, f"design_{name}", "peak")) for name in ("extended", "robust"))
    least, most = (of_run(robustness, "design_robust", f"delay_{end}_s") for end in ("least", "greatest"))
    unit, name = time_unit(least if isnan(most) else most)
    ends = (
        f"{number(least / unit)} {name} or more"
        if isnan(most)
        else f"from {apart(least / unit, most / unit, f' {name}')}"
    )
    return (
        f"{said}: ||W_a C S|| = {after}, where that design has {before}; below 1 the loop is stable around every plant "
        "within W_a. "
        f"True dead times {ends}, all else as modelled, leave the loop stable."
    )


def _judgement(compensator: Compensator | None) -> tuple[str, str, str]:
    if compensator is None:
        return "", "", ""
    judged = compensator.judgement
    sector = "any" if judged.popov_sector is None else number(judged.popov_sector)
    return number(judged.f), sector, "stable" if judged.theta2_stable else "NOT stable"


def _guarantee(table: pd.DataFrame, run: str) -> str:
    """Whether the run keeps within its guarantee, leaves it, or has none."""
    guaranteed, needed = (of_run(table, run, column) for column in ("guaranteed_sector", "needed_sector"))
    if isnan(guaranteed):
        return "" if run == "none" else "LEFT"
    if needed == 0:
        return "not needed"
    if guaranteed == 0:
        return "none"
    return "kept" if of_run(table, run, "covered") else "LEFT"


def _outcome(table: pd.DataFrame, run: str) -> tuple[str, str, str]:
    last, peak, error = (
        of_run(table, run, column) for column in ("last_saturation_s", "peak_error_after_1s", "relative_error_percent")
    )
    if isnan(error):
        return "diverges", "", ""
    last_said, peak_said = "to the end" if isnan(last) else f"{number(last)} s", "" if isnan(peak) else number(peak)
    return last_said, peak_said, f"{number(error)} %"
