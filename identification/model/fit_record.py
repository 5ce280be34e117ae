"""What a fit writes into model.json: structure, tests, intervals and errors, how W_a lies, checks by other methods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from identification.base.errors import InputError, shown
from identification.base.json_object import (
    Reader,
    member,
    number,
    numbers,
    objects,
    or_none,
    record,
    texts,
    truth,
    words,
)
from identification.model.additive_bound import AdditiveBound
from identification.model.covariance import Covariance
from identification.model.plant import PlantModel
from identification.model.plant_json import from_shape, plant_from_dict, plant_to_dict, shaped
from identification.model.reports import BoundReport, SubspaceCheck

Numbers = tuple[float, ...]
"""One for each of a plant's parameters, in their order and units."""


@dataclass(frozen=True)
class Criterion:
    """By what the structure was chosen.

    Parameters
    ----------
    name
        BIC.
    overdispersion
        By what the deviance is divided; 1 where some structure leaves noise.
    by_structure
        Its value for each structure that was tried.
    chosen
        Which of these it is; the structure's own name may have two real roots for a mode of zeta > 1.
    """

    name: str
    overdispersion: float
    by_structure: Mapping[str, float]
    chosen: str


@dataclass(frozen=True)
class Noise:
    """Of one test.

    Parameters
    ----------
    floor
        In the unit of the response.
    relative
        As a share of the response.
    """

    floor: float
    relative: float


@dataclass(frozen=True)
class FittedTest:
    """One test and its own fit.

    Parameters
    ----------
    name, sha256
        Of its file; no hash where there is no file.
    lines
        How many were fitted.
    plant, standard_errors
        Of its own fit.
    noise
        As estimated.
    chi_square
        Per degree of freedom.
    residual_correlation
        Of neighbouring lines.
    median_distance
        From its own fit, as a share of the response.
    synthetic
        Whether it was never measured.
    band
        Its lowest and highest line, in rad/s.
    left_out
        Lines that were not used, in sentences.
    remarks
        What was left out or changed while the test was read.
    conjugated
        Whether the sign of its phase was reversed.
    """

    name: str
    lines: int
    plant: PlantModel
    standard_errors: Numbers
    noise: Noise
    chi_square: float
    residual_correlation: float
    median_distance: float
    sha256: str | None
    synthetic: bool
    band: tuple[float, float]
    left_out: tuple[str, ...]
    remarks: tuple[str, ...]
    conjugated: bool

    def to_dict(self) -> dict[str, Any]:
        """An entry of ``tests``."""
        return vars(self) | {
            "plant": plant_to_dict(self.plant),
            "standard_errors": shaped(self.plant, self.standard_errors),
            "noise": asdict(self.noise),
            "band": list(self.band),
            "left_out": list(self.left_out),
            "remarks": list(self.remarks),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> FittedTest:
        """Read what :meth:`to_dict` writes; raises InputError when a member is missing or of the wrong form."""
        plant = plant_from_dict(member(content, "plant"))
        readers: dict[str, Reader] = {
            "PlantModel": lambda members, key: plant,
            "Numbers": lambda members, key: from_shape(plant, member(members, key)),
            "Noise": lambda members, key: record(Noise, member(members, key)),
            "tuple[float, float]": _band,
            "tuple[str, ...]": texts,
        }
        return record(cls, content, readers)


@dataclass(frozen=True)
class FitRecord:
    """How a model came about.

    Parameters
    ----------
    source, method, loss
        In words.
    synthetic
        Whether any of the tests was never measured.
    structure
        In words.
    criterion
        By what it was chosen.
    lower, upper
        Ends of the parameters' 95 % intervals.
    noise, misfit, scatter
        Standard errors of the parameters by the noise, by what the structure leaves, and by the scatter of the tests,
        which a single one has not.
    agreement_of_tests
        With which probability tests of one plant would differ as much; None for a single one.
    median_distances
        Of each test from the nominal plant, as a share of the response.
    cautions
        What the data leave open, in sentences.
    tests
        Each with its own fit.
    bound
        W_a and how tight it is.
    checks
        By a test's name, what a subspace model of its raw record says.
    covariance
        Of the parameters together; None where an older version wrote the file.
    """

    source: str
    synthetic: bool
    structure: str
    method: str
    loss: str
    criterion: Criterion
    lower: Numbers
    upper: Numbers
    noise: Numbers
    misfit: Numbers
    scatter: Numbers | None
    agreement_of_tests: float | None
    median_distances: tuple[float, ...]
    cautions: tuple[str, ...]
    tests: tuple[FittedTest, ...]
    bound: BoundReport
    checks: Mapping[str, SubspaceCheck]
    covariance: Covariance | None = None

    @property
    def conjugated(self) -> bool:
        """Whether the sign of any test's phase was reversed."""
        return any(test.conjugated for test in self.tests)

    @property
    def band(self) -> tuple[float, float]:
        """The lowest and the highest line of all tests, in rad/s."""
        return min(test.band[0] for test in self.tests), max(test.band[1] for test in self.tests)

    def to_dict(self, plant: PlantModel) -> dict[str, Any]:
        """The ``fit`` object of the model.json of a plant."""
        return {
            "source": self.source,
            "synthetic": self.synthetic,
            "structure": self.structure,
            "method": self.method,
            "loss": self.loss,
            "conjugated": self.conjugated,
            "criterion": asdict(self.criterion),
            "intervals_95": {"lower": shaped(plant, self.lower), "upper": shaped(plant, self.upper)},
            "noise_standard_errors": shaped(plant, self.noise),
            "misfit_standard_errors": shaped(plant, self.misfit),
            "scatter_standard_errors": None if self.scatter is None else shaped(plant, self.scatter),
            "covariance": None if self.covariance is None else self.covariance.to_dict(),
            "agreement_of_tests": self.agreement_of_tests,
            "median_distances": list(self.median_distances),
            "cautions": list(self.cautions),
            "tests": [test.to_dict() for test in self.tests],
            "bound": self.bound.to_dict(),
            "subspace_check": [
                {"test": name, **asdict(check), "said": str(check)} for name, check in self.checks.items()
            ],
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], plant: PlantModel, bound: AdditiveBound) -> FitRecord:
        """Read what :meth:`to_dict` writes beside a plant and its bound.

        Raises
        ------
        InputError
            A member is missing or of the wrong form.
        """

        def values(of: Mapping[str, Any], key: str) -> Numbers:
            return from_shape(plant, member(of, key))

        ends, tests = member(content, "intervals_95"), objects(content, "tests")
        if not tests:
            raise InputError("'tests' is empty; expected one test or more")
        return cls(
            source=words(content, "source"),
            synthetic=truth(content, "synthetic"),
            structure=words(content, "structure"),
            method=words(content, "method"),
            loss=words(content, "loss"),
            criterion=record(Criterion, member(content, "criterion"), {"Mapping[str, float]": _by_name}),
            lower=values(ends, "lower"),
            upper=values(ends, "upper"),
            noise=values(content, "noise_standard_errors"),
            misfit=values(content, "misfit_standard_errors"),
            scatter=or_none(values)(content, "scatter_standard_errors"),
            agreement_of_tests=or_none(number)(content, "agreement_of_tests"),
            median_distances=numbers(content, "median_distances"),
            cautions=texts(content, "cautions"),
            tests=tuple(FittedTest.from_dict(test) for test in tests),
            bound=BoundReport.from_dict(member(content, "bound"), bound),
            checks={words(each, "test"): SubspaceCheck.from_dict(each) for each in objects(content, "subspace_check")},
            covariance=None
            if content.get("covariance") is None
            else Covariance.from_dict(member(content, "covariance"), len(plant.parameters)),
        )


def _band(content: Mapping[str, Any], key: str) -> tuple[float, float]:
    found = numbers(content, key)
    if len(found) != 2 or not 0 < found[0] <= found[1]:
        raise InputError(f"{shown(key)} is {shown(found)}; expected two frequencies in rad/s, the lower one first")
    return found[0], found[1]


def _by_name(content: Mapping[str, Any], key: str) -> dict[str, float]:
    found = member(content, key)
    return {name: number(found, name) for name in found}
