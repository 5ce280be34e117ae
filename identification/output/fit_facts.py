"""What a fit has to say: the facts that model.json records and the table that a terminal shows."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from math import floor, log10

from identification.base.arrays import Real
from identification.base.digits import lower_end, percent
from identification.base.files import is_file, read_bytes
from identification.fitting.fit_plant import FitResult
from identification.fitting.one_fit import OneFit
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import Criterion, FitRecord, FittedTest, Noise, Numbers
from identification.model.modes import Mode
from identification.model.reports import BoundReport, SubspaceCheck
from identification.model.structure import in_physical_units
from identification.output.cautions import cautions
from identification.sweeps.response import FrequencyResponse

WIDTHS = (28, 12, 26, 11, 11)  # of the columns, at least


def standard_errors(result: FitResult) -> Numbers:
    """The standard errors of the nominal plant's parameters, in their units."""
    return _numbers(in_physical_units(result.nominal.theta, result.nominal.errors))


def fit_record(
    tests: Sequence[FrequencyResponse],
    result: FitResult,
    report: BoundReport,
    checks: Mapping[str, SubspaceCheck],
    reversed_from: float | None,
) -> FitRecord:
    """What model.json records of a fit: its tests' files, and how W_a lies over the residuals.

    ``reversed_from`` is how far the tests were from a plant before the sign of their phase was reversed; None if it
    was not.
    """
    nominal = result.nominal
    how = "each test on its own; mean of the logarithms, mean delay" if nominal.scattered else "one plant for all"
    lower, upper = nominal.intervals
    return FitRecord(
        source="identification fit",
        synthetic=any(test.synthetic for test in tests),
        structure=str(result.structure),
        method=f"maximum likelihood, {how}",
        loss="soft-L1" if result.soft else "least squares",
        criterion=Criterion(
            name="BIC",
            overdispersion=result.overdispersion,
            by_structure={str(structure): value for structure, value in result.criterion.items()},
            chosen=str(result.chosen),
        ),
        lower=_numbers(lower),
        upper=_numbers(upper),
        noise=_numbers(in_physical_units(nominal.theta, nominal.noise)),
        misfit=_numbers(in_physical_units(nominal.theta, nominal.misfit)),
        scatter=None if nominal.scatter is None else _numbers(in_physical_units(nominal.theta, nominal.scatter)),
        agreement_of_tests=nominal.agreement,
        tests=tuple(_test_record(test, fit) for test, fit in zip(tests, result.tests, strict=True)),
        median_distances=result.distances,
        cautions=tuple(cautions(result, tests, reversed_from)),
        bound=report,
        checks=checks,
        covariance=nominal.covariance,
    )


def _test_record(test: FrequencyResponse, fit: OneFit) -> FittedTest:
    file = test.path if test.path is not None and is_file(test.path) else None  # of kept responses it may be gone
    return FittedTest(
        name=fit.name,
        lines=fit.lines,
        plant=fit.plant,
        standard_errors=_numbers(in_physical_units(fit.theta, fit.errors)),
        noise=Noise(fit.floor, fit.relative),
        chi_square=fit.chi_square,
        residual_correlation=fit.correlation,
        median_distance=fit.distance,
        sha256=None if file is None else hashlib.sha256(read_bytes(file)).hexdigest(),
        synthetic=test.synthetic,
        band=(float(test.omega[0]), float(test.omega[-1])),
        left_out=tuple(map(str, test.left_out)),
        remarks=test.remarks,
        conjugated=test.conjugated,
    )


def _numbers(values: Real) -> Numbers:
    return tuple(float(value) for value in values)


def check_lines(checks: Mapping[str, SubspaceCheck]) -> list[str]:
    """A line for each raw record that was checked."""
    return [f"check of {name} by {check}" for name, check in checks.items()]


def bound_text(bound: AdditiveBound) -> str:
    """W_a(s) as a formula."""

    def product(modes: Sequence[Mode], rates: Sequence[float]) -> str:
        factors = [f"(1 + s/{rate:.4g})" for rate in rates]
        factors += [f"(1 + 2 {mode.zeta:.4g} s/{mode.omega:.4g} + (s/{mode.omega:.4g})^2)" for mode in modes]
        return " ".join(factors)

    zeros, poles = product(bound.zero_modes, bound.real_zeros), product(bound.pole_modes, bound.real_poles)
    several = len(bound.pole_modes) + len(bound.real_poles) > 1
    return f"W_a = {bound.gain:.4g} {zeros}".rstrip() + (f" / [{poles}]" if several else f" / {poles}")


def bound_remarks(report: BoundReport) -> list[str]:
    """Sentences on how W_a lies over the residuals, and on what it is where there are none."""
    least = lower_end(report.least_excess, 3)
    said = [
        f"W_a is {report.mean_excess:.3g} times the residuals' envelope on average and {report.largest_excess:.3g} "
        f"times at most; no W_a of order {report.bound.order} gets below {least}"
    ]
    if report.touches:
        first = report.touches[0]
        where = "between the lines, where only its own fit is known," if first.between_lines else "at a line"
        said.append(f"it touches the residual of {first.test} {where} at {first.omega:.4g} rad/s")
    return said if report.outside is None else [*said, str(report.outside)]


def parameter_rows(result: FitResult) -> list[tuple[str, float, float, float, float, float | None]]:
    """For each parameter its label, estimate, both ends of its 95 % interval, and what noise and scatter alone give.

    The last two are standard errors; the scatter's is None for one test. The noise's contains the misfit.
    """
    lower, upper = result.nominal.intervals
    noise = in_physical_units(result.nominal.theta, (result.nominal.noise**2 + result.nominal.misfit**2) ** 0.5)
    scatter = (
        None if result.nominal.scatter is None else in_physical_units(result.nominal.theta, result.nominal.scatter)
    )
    return [
        (
            parameter.label,
            parameter.value,
            float(lower[k]),
            float(upper[k]),
            float(noise[k]),
            None if scatter is None else float(scatter[k]),
        )
        for k, parameter in enumerate(result.plant.parameters)
    ]


def remarks(result: FitResult) -> list[str]:
    """Sentences on what the numbers rest on: structure, tests, residuals."""
    count = len(result.tests)
    said = [f"{result.structure}; {count} test{'s' if count > 1 else ''}"]
    most = "at most " if count > 1 else ""
    said.append(f"median distance of a test from this plant: {most}{percent(max(result.distances))} % of the response")
    if count > 1:
        own = max(test.distance for test in result.tests)
        said.append(f"median distance of a test from its own fit: {most}{percent(own)} %")
    if count > 1 and result.nominal.scattered:
        said.append("the tests differ by more than their noise: intervals by Student's distribution of the scatter")
    elif count > 1:
        said.append("the tests differ by no more than their noise: intervals by the noise")
    correlation = max(test.correlation for test in result.tests)
    if result.nominal.misfit.any():
        said.append(
            f"neighbouring residuals correlate by up to {correlation:.2f}: they are no noise but what this structure "
            "does not explain, and the intervals are widened for it"
        )
    if result.overdispersion > 1:
        said.append(
            f"no number of modes reduces the residuals to noise: their deviance is divided by "
            f"{result.overdispersion:.3g} in the choice of the structure"
        )
    return said


def digits_of(value: float, width: float) -> int:
    """Significant digits of a positive value that show two of the half width of its interval; 3 to 10."""
    if not 0 < width < value:
        return 3
    return min(max(2 + floor(log10(value)) - floor(log10(width / 2)), 3), 10)


def table(result: FitResult) -> str:
    """Estimate, 95 % interval, and standard errors by noise and by scatter, a line for each parameter; remarks."""
    rows = [("parameter", "estimate", "95 % interval", "noise", "scatter")]
    for label, value, lower, upper, noise, scatter in parameter_rows(result):
        digits = max(5, digits_of(max(abs(value), abs(lower), abs(upper)), upper - lower))
        interval = f"{lower:.{digits}g} ... {upper:.{digits}g}"
        rows.append(
            (label, f"{value:.{digits}g}", interval, f"{noise:.2g}", "" if scatter is None else f"{scatter:.2g}")
        )
    shown = 5 if len(result.tests) > 1 else 4
    widths = [max(least, *(2 + len(row[k]) for row in rows)) for k, least in enumerate(WIDTHS[:shown])]
    lines = [row[0].ljust(widths[0]) + "".join(map(str.rjust, row[1:shown], widths[1:])) for row in rows]
    return "\n".join([*lines, *remarks(result)])
