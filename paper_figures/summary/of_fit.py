"""What the page on a plant says of its fit: the table of parameters, and sentences on what the numbers rest on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from identification.base.digits import lower_end
from identification.base.errors import InputError
from identification.fitting.nominal_plant import ONE_PLANT
from identification.model.model_file import IdentifiedModel, plant_to_dict
from identification.output.fit_facts import bound_text, cautions, digits_of
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.captions import number

Paragraph = tuple[str, str]
"""A head and sentences."""

MOST_NAMES = 6  # of files, one by one
MOST_TOUCHES = 3  # that are named
CERTAIN = 1e-6  # a probability below this is as good as 0


@dataclass(frozen=True)
class Table:
    """A head and rows of as many cells."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def parameter_table(model: IdentifiedModel) -> Table:
    """A row for the gain, each mode (omega at the left, zeta at the right), each real root and the delay.

    Behind each estimate stand its 95 % interval and its standard errors, by noise (and what the structure leaves)
    and, if there are several tests, by their scatter.

    Raises
    ------
    InputError
        The model does not say how it was fitted.
    """
    plant = plant_to_dict(model.plant)
    scattered = fact(model.fit, "scatter_standard_errors") is not None

    def cells(*path: str | int) -> tuple[str, ...]:
        value = fact(plant, *path)
        low, high = (fact(model.fit, "intervals_95", end, *path) for end in ("lower", "upper"))
        errors = [hypot(*(fact(model.fit, f"{kind}_standard_errors", *path) for kind in ("noise", "misfit")))]
        errors += [fact(model.fit, "scatter_standard_errors", *path)] if scattered else []
        digits = digits_of(max(abs(value), abs(low), abs(high)), high - low)
        estimate, lower, upper = (_rounded(value, digits) for value in (value, low, high))
        return estimate, f"{lower} to {upper}", *(f"{error:.2g}" for error in errors)

    rows: list[tuple[str, ...]] = [("gain K", *cells("gain"))]
    for kind in ("zero", "pole"):
        for i in range(len(plant[f"{kind}_modes"])):
            pair = cells(f"{kind}_modes", i, "omega") + cells(f"{kind}_modes", i, "zeta")
            rows.append((f"{kind} mode {i + 1}, omega [rad/s]", *pair))
    for kind in ("zero", "pole"):
        rows += [(f"real {kind} [rad/s]", *cells(f"real_{kind}s", i)) for i in range(len(plant[f"real_{kind}s"]))]
    rows.append(("delay h [s]", *cells("delay_s")))
    width = max(map(len, rows))
    sureness = ("95 % interval", "noise", *(["scatter"] if scattered else []))
    head = ("parameter", "estimate", *sureness, "zeta", *sureness)[:width]
    return Table(head, tuple(row + ("",) * (width - len(row)) for row in rows))


def paragraphs(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> tuple[Paragraph, ...]:
    """What the numbers of a model rest on: tests, structure, intervals, residuals, other methods, and the bound.

    Raises
    ------
    InputError
        The model does not say how it was fitted.
    """
    return (
        ("Tests", _tests(tests)),
        ("Structure", _structure(model.fit)),
        ("Intervals", _intervals(model.fit)),
        ("Residuals", _residuals(model.fit)),
        *(("Caution", said) for said in _cautions(model)),
        *(("Subspace", said) for said in _checks(model.fit.get("subspace_check") or ())),
        ("Bound", _bound(model)),
    )


def fact(facts: Mapping[str, Any], *path: str | int) -> Any:
    """Return what stands in nested facts at a path; raises InputError if nothing does."""
    found: Any = facts
    for key in path:
        try:
            found = found[key]
        except (KeyError, IndexError, TypeError):
            where = ".".join(map(str, path))
            raise InputError(f"the fit says nothing of {where}; expected a model that was fitted to sweeps") from None
    return found


def _rounded(value: float, digits: int) -> str:
    return f"{value:#.{digits}g}".rstrip(".") if value else "0"


def _range(values: Sequence[float], digits: int = 2) -> str:
    low, high = (number(end, digits) for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _few(names: Sequence[str]) -> str:
    return ", ".join(names if len(names) <= MOST_NAMES else [*names[:2], "...", names[-1]])


def _tests(tests: Sequence[FrequencyResponse]) -> str:
    counts = Counter(test.path.name if test.path else test.name for test in tests)
    files = [name if count in (1, len(tests)) else f"{name} ({count} tests)" for name, count in counts.items()]
    low, high = min(test.omega[0] for test in tests), max(test.omega[-1] for test in tests)
    return (
        f"{len(tests)} test{'s' if len(tests) > 1 else ''} in {_few(files)}; "
        f"{sum(test.omega.size for test in tests)} lines from {number(low, 4)} to {number(high, 4)} rad/s."
    )


def _structure(fit: Mapping[str, Any]) -> str:
    form = "A mode is the factor 1 + 2 zeta s/omega + (s/omega)^2, a real root 1 + s/omega, all 1 at s = 0."
    others = dict(fact(fit, "criterion", "by_structure"))
    own = others.pop(fact(fit, "structure"), None)
    divisor = fact(fit, "criterion", "overdispersion")
    grown = f" The deviance is divided by {number(divisor)}, since no structure leaves noise." if divisor > 1 else ""
    if own is None or not others:
        return f"{form} No other structure was tried.{grown}"
    best = min(others, key=others.__getitem__)
    gain = others[best] - own
    if gain < 0:
        undetermined = f"{number(-gain)} worse than that of {best}, which the data do not determine"
        return f"{form} Its BIC is {undetermined}.{grown}"
    return f"{form} Its BIC is {number(gain)} better than that of the next best, {best}.{grown}"


def _intervals(fit: Mapping[str, Any]) -> str:
    agreement, count = fact(fit, "agreement_of_tests"), len(fact(fit, "tests"))
    if agreement is None:
        return "By the noise of the one test; how tests would differ is not known. The noise's column: standard errors."
    chance = f"below {CERTAIN:g}" if agreement < CERTAIN else f"of {number(agreement, 1)}"
    chance = f"tests of one plant would differ as much with a probability {chance}"
    errors = "The columns of noise and scatter hold standard errors"
    if agreement < ONE_PLANT:
        return (
            f"By Student's distribution of the scatter of {count} tests, as it is more than noise: {chance}. {errors}."
        )
    return f"By the noise, since the {count} tests differ by no more: {chance}. {errors}."


def _residuals(fit: Mapping[str, Any]) -> str:
    tests = fact(fit, "tests")
    of_each = {
        key: [fact(test, key) for test in tests] for key in ("median_distance", "chi_square", "residual_correlation")
    }
    floors, shares = ([fact(test, "noise", key) for test in tests] for key in ("floor", "relative"))
    misfit = any(_numbers(fact(fit, "misfit_standard_errors")))
    return (
        f"From each test's own fit: median distance {_range([100 * d for d in of_each['median_distance']])} % of the "
        f"response; noise of {_range([100 * share for share in shares])} % of the response and a floor of "
        f"{_range(floors)}; chi-square per degree of freedom {_range(of_each['chi_square'])}; correlation of "
        f"neighbours {_range(of_each['residual_correlation'])}"
        + (": that is no noise but what the structure leaves, and the intervals are widened for it." if misfit else ".")
    )


def _checks(checks: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """How far the modes that N4SID finds in the raw records are from the fitted ones, and where it gives no answer."""
    modes = [(mode, fact(check, "test")) for check in checks for mode in fact(check, "modes")]
    found = [mode for mode, _ in modes if fact(mode, "found_omega") is not None]
    if found:
        omega, zeta = (
            number(100 * max(abs(fact(mode, f"found_{key}") / fact(mode, key) - 1) for mode in found), 2)
            for key in ("omega", "zeta")
        )
        yield (
            f"N4SID, from nothing but the raw records, finds {len(found)} of their {len(modes)} modes, omega within "
            f"{omega} % and zeta within {zeta} % of the fit."
        )
    missed = [
        f"{mode['kind']} of {number(mode['omega'])} rad/s ({test})"
        for mode, test in modes
        if mode["found_omega"] is None
    ]
    if missed:
        yield f"N4SID finds no {_few(missed)}."
    for reason in dict.fromkeys(fact(check, "reason") for check in checks):
        if reason is not None:
            names = [fact(check, "test") for check in checks if check["reason"] == reason]
            yield f"No answer by N4SID from {_few(names)}: {reason}."


def _cautions(model: IdentifiedModel) -> list[str]:
    distance = max(fact(test, "median_distance") for test in fact(model.fit, "tests"))
    return [f"{said[0].upper()}{said[1:]}." for said in cautions(model.plant, distance)]


def _bound(model: IdentifiedModel) -> str:
    facts = fact(model.fit, "bound")
    touches = [
        f"{fact(touch, 'test')} at {number(fact(touch, 'omega'), 4)} rad/s"
        + (" between the lines" if fact(touch, "between_lines") else "")
        for touch in fact(facts, "touches")[:MOST_TOUCHES]
    ]
    return (
        f"{bound_text(model.additive_bound)}: at no line below the distance of a test from the model, nor between the "
        "lines, as far as was looked, below that of its own fit, "
        f"{number(fact(facts, 'mean_excess'))} times their envelope on average and "
        f"{number(fact(facts, 'largest_excess'))} times at most (no bound of this order gets below "
        f"{lower_end(fact(facts, 'least_excess'), 3)}). It touches {', '.join(touches)}."
    )


def _numbers(facts: Any) -> list[float]:
    """Every number in nested facts."""
    if isinstance(facts, Mapping):
        facts = list(facts.values())
    return [value for entry in facts for value in _numbers(entry)] if isinstance(facts, list) else [float(facts)]
