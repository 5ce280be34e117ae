"""What the page on a plant says of its fit: the table of parameters, and sentences on what the numbers rest on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from identification.base.digits import lower_end
from identification.base.errors import InputError, printable
from identification.fitting.nominal_plant import ONE_PLANT
from identification.fitting.structure_fits import ALIKE
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import FitRecord
from identification.model.model_file import IdentifiedModel
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport, SubspaceCheck
from identification.model.signals import UNNAMED, Signals
from identification.output.fit_facts import bound_text, digits_of
from identification.sweeps.response import FrequencyResponse
from paper_figures.look.captions import capitalised, number

Paragraph = tuple[str, str]
"""A head and sentences."""

SYMBOLS = {"delay [s]": "delay h [s]"}
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
    fit = fitted(model)
    ends, errors = zip(fit.lower, fit.upper, strict=True), zip(fit.noise, fit.misfit, strict=True)
    columns = [[hypot(*both) for both in errors], *([fit.scatter] if fit.scatter is not None else [])]

    def cells(value: float, low: float, high: float, *errors: float) -> tuple[str, ...]:
        digits = digits_of(max(abs(value), abs(low), abs(high)), high - low)
        estimate, lower, upper = (_rounded(value, digits) for value in (value, low, high))
        return estimate, f"{lower} to {upper}", *(f"{error:.2g}" for error in errors)

    values = [parameter.value for parameter in model.plant.parameters]
    said = [cells(value, *both, *beside) for value, both, *beside in zip(values, ends, *columns, strict=True)]
    sureness = ("95 % interval", "noise", *(["scatter"] if fit.scatter is not None else []))
    return plant_table(model.plant, said, ("estimate", *sureness), model.signals)


def plant_table(
    plant: PlantModel, cells: Sequence[tuple[str, ...]], head: tuple[str, ...], signals: Signals = UNNAMED
) -> Table:
    """A row for each parameter of a plant, for a mode omega at the left and zeta at the right.

    Parameters
    ----------
    plant
        Whose parameters are named.
    cells
        What is said of each of ``plant.parameters``.
    head
        Of these cells; that of zeta begins with its name.
    signals
        Whose units the gain has.
    """
    unit = _gain_unit(signals, plant.integrators)
    symbols = SYMBOLS | {"gain": f"gain K [{unit}]" if unit else "gain K"}
    rows: list[tuple[str, ...]] = []
    for parameter, said in zip(plant.parameters, cells, strict=True):
        if parameter.quantity == "zeta":
            rows[-1] += said
        else:
            rows.append((symbols.get(parameter.label, parameter.label), *said))
    width = max(map(len, rows))
    return Table(
        ("parameter", *head, "zeta", *head[1:])[:width], tuple(row + ("",) * (width - len(row)) for row in rows)
    )


def paragraphs(model: IdentifiedModel, tests: Sequence[FrequencyResponse]) -> tuple[Paragraph, ...]:
    """What the numbers of a model rest on: tests, structure, intervals, residuals, other methods, and the bound.

    Raises
    ------
    InputError
        The model does not say how it was fitted.
    """
    fit = fitted(model)
    return (
        ("Tests", _tests(tests)),
        ("Structure", _structure(fit)),
        ("Intervals", _intervals(fit)),
        ("Residuals", _residuals(fit)),
        *(("Subspace", said) for said in _checks(fit.checks)),
        ("Bound", _bound(model.additive_bound, fit.bound)),
    )


def fitted(model: IdentifiedModel) -> FitRecord:
    """How a model was fitted; raises InputError if it does not say."""
    if model.fit is None:
        raise InputError("the model holds no fit that this version reads; expected one that it fitted to sweeps")
    return model.fit


def _gain_unit(signals: Signals, integrators: int) -> str:
    """The unit of K in K/s^integrators: output over input, with as many seconds below, or above."""
    if not signals.gain_unit:
        return ""
    above, below = signals.output_unit, signals.input_unit
    seconds = "" if integrators == 0 else "s" if abs(integrators) == 1 else f"s^{abs(integrators)}"
    above, below = (above, f"{below} {seconds}") if integrators > 0 else (f"{above} {seconds}", below)
    above, below = above.strip() or "1", below.strip()
    above, below = (f"({each})" if set(each) & set(" /*") else each for each in (above, below))
    return f"{above}/{below}" if below else above


def _rounded(value: float, digits: int) -> str:
    return f"{value:#.{digits}g}".rstrip(".") if value else "0"


def _range(values: Sequence[float], digits: int = 2) -> str:
    low, high = (number(end, digits) for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _few(names: Sequence[str]) -> str:
    return ", ".join(names if len(names) <= MOST_NAMES else [*names[:2], "...", names[-1]])


def _tests(tests: Sequence[FrequencyResponse]) -> str:
    counts = Counter(printable(test.path.name) if test.path else test.name for test in tests)
    files = [name if count in (1, len(tests)) else f"{name} ({count} tests)" for name, count in counts.items()]
    low, high = min(test.omega[0] for test in tests), max(test.omega[-1] for test in tests)
    rest = [lines for test in tests for lines in test.left_out]
    reasons = "; ".join(dict.fromkeys(lines.reason for lines in rest))
    left_out = f" {sum(lines.omega.size for lines in rest)} lines are left out ({reasons})." if rest else ""
    remarks = "; ".join(dict.fromkeys(said for test in tests for said in test.remarks))
    as_read = f" As read: {remarks}." if remarks else ""
    return (
        f"{len(tests)} test{'s' if len(tests) > 1 else ''} in {_few(files)}; "
        f"{sum(test.omega.size for test in tests)} lines from {number(low, 4)} to {number(high, 4)} rad/s."
        f"{left_out}{as_read}"
    )


def _structure(fit: FitRecord) -> str:
    form = "A mode is the factor 1 + 2 zeta s/omega + (s/omega)^2, a real root 1 + s/omega, all 1 at s = 0."
    others = dict(fit.criterion.by_structure)
    own = others.pop(fit.criterion.chosen, None)
    divisor = fit.criterion.overdispersion
    grown = f" The deviance is divided by {number(divisor)}, since no structure leaves noise." if divisor > 1 else ""
    if own is None or not others:
        return f"{form} No other structure was tried.{grown}"
    best = min(others, key=others.__getitem__)
    gain = others[best] - own
    if gain < 0:
        return f"{form} Its BIC is {number(-gain)} worse than that of {best}; {_why_worse(fit, best)}.{grown}"
    return f"{form} Its BIC is {number(gain)} better than that of the next best, {best}.{grown}"


def _why_worse(fit: FitRecord, best: str) -> str:
    """Why a structure was taken though another one has the better BIC: the rules of the selection."""
    own = fit.criterion.chosen
    if _count(own, "integrator") > _count(best, "integrator"):
        return f"of structures whose BIC is within {ALIKE:g} the one with most integrators is taken"
    right = [
        _count(each, "right-half-plane zero mode") * 2 + _count(each, "right-half-plane real zero")
        for each in (own, best)
    ]
    if right[0] < right[1]:
        return f"a zero in the right half plane is taken only where the BIC is better by more than {ALIKE:g} for each"
    return "roots of that one lie far outside the band of the lines, or the data do not determine them"


def _count(structure: str, kind: str) -> int:
    """How many of a kind a structure in words has."""
    return sum(int(word.split()[0]) for word in structure.split(", ") if word.rstrip("s").endswith(f" {kind}"))


def _intervals(fit: FitRecord) -> str:
    agreement, count = fit.agreement_of_tests, len(fit.tests)
    if agreement is None:
        return (
            "They come from the noise of the one test; how tests would differ is not known. The column of noise holds "
            "standard errors."
        )
    chance = f"below {CERTAIN:g}" if agreement < CERTAIN else f"of {number(agreement, 1)}"
    chance = f"tests of one plant would differ as much with a probability {chance}"
    errors = "The columns of noise and scatter hold standard errors"
    if agreement < ONE_PLANT:
        return (
            f"They come from the scatter of the {count} tests by Student's distribution, because the noise does not "
            f"explain it: {chance}. {errors}."
        )
    return f"They come from the noise, because the {count} tests differ by no more: {chance}. {errors}."


def _residuals(fit: FitRecord) -> str:
    return (
        "Between each test and its own fit: median distance "
        f"{_range([100 * test.median_distance for test in fit.tests])} % of the response; noise of "
        f"{_range([100 * test.noise.relative for test in fit.tests])} % of the response and a "
        f"floor of {_range([test.noise.floor for test in fit.tests])}; chi-square per degree of freedom "
        f"{_range([test.chi_square for test in fit.tests])}; correlation of neighbours "
        f"{_range([test.residual_correlation for test in fit.tests])}"
        + (
            ". This is not noise: the structure does not explain it, and the intervals are widened for it."
            if any(fit.misfit)
            else "."
        )
    )


def _checks(checks: Mapping[str, SubspaceCheck]) -> Iterator[str]:
    """How far the modes that N4SID finds in the raw records are from the fitted ones, and where it gives no answer."""
    modes = [(mode, test) for test, check in checks.items() for mode in check.modes]
    changes = [
        (abs(mode.found_omega / mode.omega - 1), abs(mode.found_zeta / mode.zeta - 1))
        for mode, _ in modes
        if mode.found_omega is not None and mode.found_zeta is not None
    ]
    if changes:
        omega, zeta = (number(100 * max(of), 2) for of in zip(*changes, strict=True))
        yield (
            f"The method N4SID, which uses the raw records alone, finds {len(changes)} of their {len(modes)} modes, "
            f"with omega within {omega} % and zeta within {zeta} % of the fit."
        )
    missed = [f"{mode.kind} of {number(mode.omega)} rad/s ({test})" for mode, test in modes if mode.found_omega is None]
    if missed:
        yield f"N4SID does not find the {_few(missed)}."
    for reason in dict.fromkeys(check.reason for check in checks.values()):
        if reason is not None:
            names = [test for test, check in checks.items() if check.reason == reason]
            yield f"N4SID gives no answer for {_few(names)}: {reason}."


def cautions(model: IdentifiedModel) -> list[str]:
    """What the data leave open, a sentence each; raises InputError if the model does not say how it was fitted."""
    fit = fitted(model)
    names = [test.name for test in fit.tests]
    return [f"{capitalised(said, *names)}." for said in fit.cautions]


def _bound(bound: AdditiveBound, report: BoundReport) -> str:
    touches = [
        f"{touch.test} at {number(touch.omega, 4)} rad/s" + (" between the lines" if touch.between_lines else "")
        for touch in report.touches[:MOST_TOUCHES]
    ]
    return (
        f"W_a bounds how far the plant may be from the model: {bound_text(bound)}. At every line it is at least the "
        "distance of each test from the model; between the lines, as far as was searched, it is at least the distance "
        f"of each test's own fit. It is {number(report.mean_excess)} times the largest of these distances on average "
        f"and {number(report.largest_excess)} times at most; no bound of this order gets below "
        f"{lower_end(report.least_excess, 3)} times."
        + (f" It touches {', '.join(touches)}." if touches else "")
        + (f" {capitalised(str(report.outside))}." if report.outside else "")
    )
