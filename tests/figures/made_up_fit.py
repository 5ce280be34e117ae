"""A fit and designs with numbers that nobody computed, for the pages that put them into words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.anti_windup.compensator import second_order
from design.anti_windup.judge import CorrectedCompensator, Judgement, PrintedCompensator
from design.blocks.block import Block
from design.design_file import Design
from design.hinf.mixed_sensitivity import Synthesis
from design.parameters import DelayFreeParameters, ExtendedParameters
from identification.model.additive_bound import AdditiveBound
from identification.model.fit_record import Criterion, FitRecord, FittedTest, Noise
from identification.model.model_file import IdentifiedModel
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.reports import BoundReport, Excess, Touch
from identification.model.signals import UNNAMED, Signals
from identification.model.structure import Structure
from identification.sweeps.response import FrequencyResponse

SIMPLE = AdditiveBound.printed_form(0.3, 40.0, 60.0, 0.2)
RICH = AdditiveBound(0.3, (Mode(20.0, 0.4),), (Mode(15.0, 0.3), Mode(70.0, 0.2)), (40.0,), ())


def plant_of(modes: int, integrators: int = 1, poles: int = 0) -> PlantModel:
    return PlantModel(
        2.0,
        tuple(Mode(20.0 * 1.5**i, 0.05) for i in range(modes)),
        tuple(Mode(25.0 * 1.5**i, 0.04) for i in range(modes)),
        0.004,
        integrators,
        real_poles=(12.5,) * poles,
    )


def sweeps_of(plant: PlantModel, count: int, synthetic: bool = False) -> list[FrequencyResponse]:
    omega = np.geomspace(5.0, 400.0, 60)
    response = plant(1j * omega)
    return [
        FrequencyResponse(omega, response * (1.02 + 0.01 * i + 0.01 * np.sin(40 * omega)), None, f"day_{i}.csv")
        if not synthetic
        else FrequencyResponse(omega, 1.1 * response, None, f"day_{i}.csv", synthetic=True)
        for i in range(count)
    ]


def record_of(plant: PlantModel, tests: list[FrequencyResponse], bound: AdditiveBound) -> FitRecord:
    zeros, poles = (
        2 * len(modes) + len(rates)
        for modes, rates in ((plant.zero_modes, plant.real_zeros), (plant.pole_modes, plant.real_poles))
    )
    structure = Structure(plant.integrators, zeros, poles)

    def share(part: float) -> tuple[float, ...]:
        return tuple(part * parameter.value for parameter in plant.parameters)

    return FitRecord(
        source="identification fit",
        synthetic=any(test.synthetic for test in tests),
        structure=str(structure),
        method="maximum likelihood",
        loss="least squares",
        criterion=Criterion("BIC", 1.0, {str(structure): 5.0, "1 integrator": 99.0}, str(structure)),
        lower=share(0.98),
        upper=share(1.02),
        noise=share(0.003),
        misfit=share(0.0),
        scatter=share(0.01) if len(tests) > 1 else None,
        agreement_of_tests=1e-9 if len(tests) > 1 else None,
        median_distances=(0.012,) * len(tests),
        cautions=("the data show no dead time",) if plant.delay_s == 0 else (),
        tests=tuple(
            FittedTest(
                name=test.name,
                lines=test.omega.size,
                plant=plant,
                standard_errors=share(0.003),
                noise=Noise(2e-4, 0.0125),
                chi_square=1.02,
                residual_correlation=0.03,
                median_distance=0.012,
                sha256=None,
                synthetic=test.synthetic,
                band=(float(test.omega[0]), float(test.omega[-1])),
                left_out=(),
                remarks=(),
                conjugated=False,
            )
            for test in tests
        ),
        bound=BoundReport(
            bound, 12.5, 3.25, 11.75, Excess(1.0, 1.0, 1.0), None, (Touch(55.5, tests[0].name, False, 1.0),)
        ),
        checks={},
    )


def model_of(
    plant: PlantModel, tests: list[FrequencyResponse], bound: AdditiveBound = SIMPLE, signals: Signals = UNNAMED
) -> IdentifiedModel:
    return IdentifiedModel(plant, bound, None, record_of(plant, tests, bound), signals)


def design_of(kind: str) -> Design:
    judged = Judgement(0.0625, 50.0, None, 0.0, 48.5, False, None, 0.125)
    delay_free = kind == "delay-free"
    return Design(
        kind=kind,
        plant=plant_of(1),
        additive_bound=SIMPLE,
        reference_omegas=(1.5,),
        blocks={"K": Block(1.0, (), (1 + 0j,)), "C0": Block(1.0), "T_so": Block(1.0, (), (-4 + 0j, -1 + 2j, -1 - 2j))},
        hinf=Synthesis(0.3125, "", 0.375, 0.5, 0.3125, "", 0.375, Block(1.0), Block(1.0)) if delay_free else None,
        parameters=DelayFreeParameters(4.0, 1e-4) if delay_free else ExtendedParameters(4.0, (), "zeros", 0.0, {}),
        thesis=PrintedCompensator(second_order(0.03, 0.02, 48.5), judged, 0.03, 0.02, 48.5),
        corrected=CorrectedCompensator(
            second_order(0.5, 0.5, -1.0),
            replace(judged, popov_sector=1.0, theta2_stable=True, recovery_s=1.75),
            "sector",
            "",
            0.75,
            275.0,
            0.03125,
            None,
        ),
    )
