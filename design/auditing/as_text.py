"""The audit of a design in words and tables, as the command line prints it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from design.auditing.audit_design import Audit
from design.blocks.block import bound_block, plant_block
from design.design_file import Design
from design.hinf.mixed_sensitivity import Infimum, Synthesis
from design.stability.margins import Margins
from design.stability.stable_intervals import LARGEST, Interval, Margin
from identification.base.digits import lower_end, upper_end
from identification.model.plant import PlantModel

NAMED = 6  # intervals of stability that are named, of each kind


def audit_text(design: Design, found: Audit, windup: float) -> str:
    """What an audit found.

    Parameters
    ----------
    design
        The audited design.
    found
        Of :func:`design.auditing.audit_design.audit`.
    windup
        Integral of u - sat(u) in input unit times second, for the lasting offset.
    """
    omegas = ", ".join(f"{omega:g}" for omega in design.reference_omegas)
    lines = [f"{design.kind} design, reference at {omegas} rad/s, {_plant_in_words(design.loop_plant)}", ""]
    lines += ["The linear loop" + (", its dead time exact" if design.loop_plant.delay_s else "")]
    if isinstance(found.roots, str):
        lines.append(f"  rightmost characteristic roots  {found.roots}")
    else:
        roots, hidden = found.roots.roots, found.roots.hidden
        roots = np.where(np.abs(roots.imag) > found.roots.uncertainty, roots, roots.real)
        moved = _roots(roots[~hidden]) or f"none right of {found.roots.line:.4g} 1/s, the limit set by rounding errors"
        lines.append(f"  rightmost characteristic roots  {moved}")
        lines.append(f"  cancelled between the blocks    {_roots(roots[hidden]) or 'none'}")
    lines += _form_lines(design)
    lines += _margin_lines(found.margins)
    lines.append(
        f"  |W_a/P| at the reference        {found.tracking_floor:.4g}: every controller that follows it has this "
        "|W_a C S| there"
    )
    covered = _covered(found.covered_delay_s)
    gain = "; no other gain of the integrator" if design.plant.integrators > 0 else ""
    lines.append(f"  within W_a                      {covered}{gain}")
    if found.same_controller is not None:
        lines.append(f"  C_aw = C_s                      to {found.same_controller:.1g}")
    if found.with_delay is not None:
        lines += ["", f"The same controller on the plant with its dead time of {_time(design.plant.delay_s, 0.0)}"]
        lines += _margin_lines(found.with_delay)
    if found.stabiliser is not None and found.infimum is not None:
        lines += ["", "H-infinity stabiliser, ||[W1 S; W2 T]||", *_hinf_lines(found.stabiliser, found.infimum)]
    without = ", for the plant without its dead time" if found.with_delay is not None else ""
    lines += ["", f"Anti-windup{without}", *_columns(_anti_windup_rows(found, windup))]
    lines.append(
        "  theta1~ s, theta2 s: time for its slowest mode to fall to 1 %; y_d = theta2 u~ keeps modes of the plant."
    )
    own = design.corrected
    lines += ["", f"The guarantee of the corrected one is {own.guarantee}: {found.guarantee}."]
    alpha, beta, gamma, f = found.least_f
    bandwidth = own.bandwidth
    lines += [
        "",
        f"The best found of (2.23) with no pole beyond {bandwidth:g} rad/s: alpha = {alpha:.4g} s, "
        f"beta = {beta:.4g} s, gamma = {gamma:.4g}, f = {f:.4g}.",
    ]
    if bound_block(design.additive_bound).relative_degree > 0:
        lines.append("Without this bound on the poles, f tends to 0 as alpha, beta -> 0 and gamma -> -1.")
    return "\n".join(lines)


def _form_lines(design: Design) -> list[str]:
    """The modes in Re s >= 0 that each form of the controller hides inside, and what they do."""
    anchors = plant_block(design.plant).unstable_poles
    if design.hinf is not None or not anchors:
        return []
    fastest = max(anchor.real for anchor in anchors)
    integral = "integral" if len(anchors) == 1 else "double integral"
    moves = f"y grows like exp({fastest:.4g} t)" if fastest > 0 else f"y drifts as the {integral} of it"
    return [
        f"  hidden as drawn in Fig. 2.6     {_roots(np.array(anchors))}: no feedback corrects a rounding error or an "
        f"initial state in them: {moves}",
        "  hidden on a computer            none in Re s >= 0 (sampled; --form thesis runs the drawn form)",
    ]


def _plant_in_words(plant: PlantModel) -> str:
    """Its gain, the roots at s = 0 where they are not the thesis's one integrator, its modes and real roots."""
    zeros, poles, at_zero = len(plant.zero_modes), len(plant.pole_modes), plant.integrators
    parts = [f"gain {plant.gain:g}"]
    if at_zero != 1:
        parts.append(f"{at_zero} integrators" if at_zero >= 0 else f"{-at_zero} zeros at s = 0")
    parts.append(f"{zeros} zero and {poles} pole modes")
    parts += [
        f"{kind} at {', '.join(f'{-rate:.4g}' for rate in rates)} rad/s"
        for kind, rates in (("real zeros", plant.real_zeros), ("real poles", plant.real_poles))
        if rates
    ]
    return f"plant of {', '.join(parts)}, dead time {_time(plant.delay_s, 0.0)}"


def _hinf_lines(stabiliser: Synthesis | str, infimum: Infimum | str) -> Iterable[str]:
    reached = stabiliser if isinstance(stabiliser, str) else f"{upper_end(stabiliser.gamma, 6)} at most"
    yield f"  of this K                       {reached}"
    if isinstance(infimum, Infimum):
        ends, decay = _interval(infimum.lower, infimum.upper), lower_end(infimum.decay_rate, 3)
        yield f"  infimum of (2.8)                in {ends}, its upper end by a K whose loop decays with {decay} 1/s"
        yield f"    no K below                    {infimum.reason}"
    else:
        yield f"  infimum of (2.8)                {infimum}"
    if isinstance(stabiliser, Synthesis):
        ends = _interval(stabiliser.gamma_line_lower, stabiliser.gamma_line)
        yield f"  with a decay of {lower_end(stabiliser.decay_rate, 4):<15s} in {ends} on that line"
        yield f"    no K below                    {stabiliser.line_reason}"


def _interval(lower: float, upper: float) -> str:
    return f"[{lower_end(lower, 6)}, {upper_end(upper, 6)}]"


def _covered(delay_s: float) -> str:
    if delay_s == 0:
        return "no other dead time"
    return "any dead time" if np.isinf(delay_s) else f"dead times off by up to {_time(delay_s, 0.0, 4)}"


def _roots(roots: np.ndarray) -> str:
    """Roots by decreasing real part, conjugates once, and how often where more than once."""
    said = Counter(
        f"{root.real:.4g} +- {root.imag:.4g}j" if root.imag else f"{root.real:.4g}" for root in roots if root.imag >= 0
    )
    return ", ".join(root if count == 1 else f"{root} ({count} times)" for root, count in said.items())


def _margin_lines(margins: Margins | str | None) -> Iterable[str]:
    if not isinstance(margins, Margins):
        return [f"  no margins                      {margins}"]
    guarantee = (
        "the loop is stable with every plant within W_a that has as many poles in Re s > 0 as the model"
        if margins.is_guaranteed
        else "NO guarantee for the plants within W_a"
    )
    gains = _intervals(margins.gains, (f"{1 / LARGEST:g} or less", f"{LARGEST:g} or more"), lambda k: f"{k:.4g}")
    phase = "any" if margins.phase_deg.omega is None else _end(margins.phase_deg, "", lambda phi: f"{phi:.4g} deg")
    if len(margins.phases_deg) > 1:
        phase += f", and {_intervals(margins.phases_deg[1:], ('0', '180 deg'), lambda phi: f'{phi:.4g} deg')}"
    return [
        f"  gain factors                    {gains}",
        f"  phase margin                    {phase}",
        f"  true dead times                 {_delays(margins)}",
        f"  modulus margin                  {_margin(margins.modulus)}",
        f"  |W_a C S| at most               {_margin(margins.W_a_C_S)}: {guarantee}",
    ]


def _margin(margin: Margin) -> str:
    at = "infinity" if margin.omega is None or np.isinf(margin.omega) else f"{margin.omega:.4g} rad/s"
    return f"{margin.value:.4g} (at {at})"


def _end(margin: Margin, unlimited: str, said: Callable[[float], str]) -> str:
    return unlimited if margin.omega is None else f"{said(margin.value)} (at {margin.omega:.4g} rad/s)"


def _intervals(intervals: Sequence[Interval], unlimited: tuple[str, str], said: Callable[[float], str]) -> str:
    """Intervals one after the other; the first few where there are many."""
    low, high = unlimited
    words = [f"{_end(each.least, low, said)} to {_end(each.greatest, high, said)}" for each in intervals[:NAMED]]
    more = len(intervals) - NAMED
    if more > 0:
        words.append(f"{more} more up to {_end(intervals[-1].greatest, high, said)}")
    return " and ".join(words)


def _delays(margins: Margins) -> str:
    """The true dead times, in as many digits as tell the ends of the model's interval from its own dead time."""
    own, (low, high) = margins.delay_s, margins.delays_listed_s
    ends = [end.value for end in (margins.delay_least_s, margins.delay_greatest_s) if end.omega is not None]
    nearest = min((abs(end - own) for end in ends if end != own), default=own)
    digits = 4 if nearest == 0 or own == 0 else min(max(4, 2 + int(np.ceil(np.log10(own / nearest)))), 15)

    def said(delay_s: float) -> str:
        return _time(delay_s, own, digits)

    words = _intervals(margins.delays_s, ("0", "any"), said)
    beyond = [f"below {said(low)}"] * (low > 0) + [f"above {said(high)}"] * bool(np.isfinite(high))
    return words + (f"; those {' and '.join(beyond)} were not looked at" if beyond else "")


def _time(time_s: float, beside_s: float, digits: int = 6) -> str:
    """A time in s where it or the one that it is read beside is a second or more, else in ms."""
    return f"{time_s:.{digits}g} s" if max(time_s, beside_s) >= 1 else f"{1e3 * time_s:.{digits}g} ms"


def _anti_windup_rows(found: Audit, windup: float) -> list[Sequence[str]]:
    head = ("name", "f", "at rad/s", "Popov sector", "slope 1/s", "for all of W_a", "theta1~(0)", "theta2")
    rows: list[Sequence[str]] = [(*head, f"offset of {windup:g}", "theta1~ s", "theta2 s")]
    for name, judged in found.anti_windup.items():
        multiplier, sector = judged.popov_multiplier_s, found.robust_sector[name]
        rows.append(
            (
                name,
                f"{judged.f:.4g}",
                "infinity" if judged.f_omega is None else f"{judged.f_omega:.4g}",
                "any" if judged.popov_sector is None else lower_end(judged.popov_sector, 4),
                f"{1 / multiplier:.4g}" if multiplier else "circle",
                "none" if sector == 0 else ("any" if np.isinf(sector) else f"{sector:.4g}"),
                f"{judged.theta1_tilde_at_zero:.4g}",
                "stable" if judged.theta2_stable else "NOT stable",
                "grows" if judged.lasting_offset is None else f"{judged.lasting_offset * windup:.4g}",
                f"{judged.recovery_s:.4g}",
                f"{found.output_recovery_s[name]:.4g}" if judged.theta2_stable else "never",
            )
        )
    return rows


def _columns(rows: Sequence[Sequence[str]]) -> Iterable[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
