"""The steps of a build: which commands make which files from which, for one model and its sweeps."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from antiwindup.code_files import figure_tables

OF_NO_MODEL = ("pid", "conditions")
"""Experiments of the thesis that hang on no plant but those it prints."""


@dataclass(frozen=True)
class Step:
    """One command of a build.

    Parameters
    ----------
    name
        For the progress bar.
    command
        The room and what stands after it on a command line.
    outputs
        The files that it writes, all of them below the folder of the build.
    needs
        The files that it cannot do without.
    uses
        Files of which it reads those that are there.
    is_vital
        Whether a build stops when it refuses, whatever else does not.
    """

    name: str
    command: tuple[str, ...]
    outputs: tuple[Path, ...]
    needs: tuple[Path, ...] = ()
    uses: tuple[Path, ...] = ()
    is_vital: bool = False

    @property
    def refusal(self) -> Path:
        """The file that holds the sentence with which the command refused."""
        return self.outputs[0].with_suffix(".refused.txt")


@dataclass(frozen=True)
class Asked:
    """What a build is for.

    Parameters
    ----------
    folder
        To write to.
    model
        A model.json, the words table or implied, or None for the one fitted to the sweeps.
    sweeps
        Files and folders of tests, as they were given.
    sweep_files
        The files that they mean.
    fit
        Options of ``identification fit``.
    limit
        Saturation limits +-limit instead of the thesis's.
    plants
        How many plants are drawn within W_a.
    """

    folder: Path
    model: str | None
    sweeps: tuple[str, ...]
    sweep_files: tuple[Path, ...]
    fit: tuple[str, ...] = ()
    limit: float | None = None
    plants: int = 200

    @property
    def chosen(self) -> str:
        """The model as a command takes it."""
        return self.model or str(self.folder / "model.json")

    @property
    def model_files(self) -> tuple[Path, ...]:
        """The file of the model, if it has one."""
        named = self.model is not None and self.model.isidentifier() and not os.path.lexists(self.model)
        return () if named else (Path(self.chosen),)

    @property
    def tests(self) -> tuple[tuple[str, ...], tuple[Path, ...]]:
        """The tests as a command takes them, and their files: those that the fit kept, or else the sweeps."""
        kept = self.folder / "responses.npz"
        return (self.sweeps, self.sweep_files) if self.model else ((str(kept),), (kept,))


def refit_steps(asked: Asked) -> list[Step]:
    """Fit, designs, experiments and figures of a plant, and the page that sums them up."""
    made = [*_fit(asked), *_designs(asked), *_experiments(asked)]
    drawn = [
        step for step in _figures(asked.folder) if any(not path.name.startswith(OF_NO_MODEL) for path in step.needs)
    ]
    return [*made, *drawn, _summary(asked, made)]


def thesis_steps(asked: Asked) -> list[Step]:
    """What every figure of the thesis, and of ours, is drawn from, for one model; and the figures."""
    of_thesis = [_tables(asked.folder, "pid"), _tables(asked.folder, "conditions")]
    return [*_fit(asked), *_designs(asked), *of_thesis, *_experiments(asked), *_figures(asked.folder)]


def report_steps(asked: Asked, before: Sequence[Step]) -> list[Step]:
    """The ledger judged anew, and the page that shows it with all that the steps before made."""
    folder, (tests, files) = asked.folder, asked.tests
    claims = ("experiments", "thesis", "claims", "--output", str(folder))
    judged = Step("claims", claims, (folder / "claims.csv",))
    page = ("paper_figures", "report", "--build", str(folder), "--", asked.chosen, *tests)
    made = tuple(
        path for step in before for path in (*step.outputs, step.refusal) if path.suffix not in (".pdf", ".png")
    )
    needs, output = (*asked.model_files, *files, folder / "claims.csv"), folder / "report" / "index.html"
    reported = Step("report", page, (output,), needs, made, is_vital=True)
    return [judged, reported]


def _fit(asked: Asked) -> list[Step]:
    if asked.model is not None:
        return []
    model, responses = asked.folder / "model.json", asked.folder / "responses.npz"
    command = ("identification", "fit", *asked.fit, "--output", str(model), "--responses", str(responses))
    return [Step("fit", (*command, "--", *asked.sweeps), (model, responses), asked.sweep_files, is_vital=True)]


def _designs(asked: Asked) -> list[Step]:
    """With the thesis's references and free parameters; robust has a roll-off, so that W_a guarantees its stability."""
    extended = ("extended", "--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1")
    commands = {
        "delay_free": ("delay-free", "--reference-hz", "0.25", "--epsilon", "1e-4"),
        "extended": extended,
        "robust": (*extended, "--robust-level", "0.9"),
    }
    designs = {name: asked.folder / f"design_{name}.json" for name in commands}
    return [
        Step(
            f"design {name}",
            ("design", *words, "--output", str(designs[name]), "--", asked.chosen),
            (designs[name],),
            asked.model_files,
        )
        for name, words in commands.items()
    ]


def _experiments(asked: Asked) -> list[Step]:
    folder, (tests, files) = asked.folder, asked.tests
    delay_free, extended, robust = (folder / f"design_{name}.json" for name in ("delay_free", "extended", "robust"))
    limit = () if asked.limit is None else ("--limit", str(asked.limit))
    campaign = folder / "results" / "campaign.parquet"
    plants = ("--plants", str(asked.plants), "--seed", "1", *limit, "--anew", "--output", str(campaign))
    return [
        Step(
            "additive-error",
            (
                "experiments",
                "thesis",
                "additive-error",
                "--output",
                str(folder / "results"),
                "--",
                asked.chosen,
                *tests,
            ),
            _csv(folder, "additive_error", "additive_error_summary"),
            (*asked.model_files, *files),
        ),
        _tables(folder, "f-gamma", extended),
        _tables(folder, "chapter-2", delay_free, options=limit, stem="delay_free"),
        _tables(folder, "chapter-4", extended, options=limit, stem="extended"),
        _tables(folder, "trade-off", extended),
        _tables(folder, "interpolation", extended, more=("interpolation_map",)),
        _tables(folder, "robustness", extended, robust),
        _tables(folder, "limits", delay_free, stem="limits_delay_free"),
        _tables(folder, "limits", extended, stem="limits_extended"),
        _tables(folder, "sampled-rates", extended, options=limit, stem="sampled"),
        Step(
            "compare",
            ("experiments", "thesis", "compare", *limit, "--output", str(folder / "results"), "--", str(extended)),
            _csv(folder, "compare", "compare_runs"),
            (extended,),
        ),
        _tables(folder, "hidden-modes", extended, options=limit),
        Step("campaign", ("experiments", "thesis", "campaign", *plants, "--", str(extended)), (campaign,), (extended,)),
        Step(
            "campaign-tables",
            ("experiments", "campaign-tables", "--output", str(folder / "results"), "--", str(campaign)),
            _csv(folder, "campaign_distance", "campaign", "campaign_summary"),
            (campaign,),
        ),
    ]


def _tables(
    folder: Path,
    name: str,
    *designs: Path,
    options: tuple[str, ...] = (),
    stem: str | None = None,
    more: tuple[str, ...] = (),
) -> Step:
    """An experiment of the thesis with designs, its table and summary; the stem of these is its name unless given."""
    stem = stem or name.replace("-", "_")
    command = ("experiments", "thesis", name, *options, "--output", str(folder / "results"), "--", *map(str, designs))
    return Step(stem, command, _csv(folder, stem, *more, f"{stem}_summary"), designs)


def _figures(folder: Path) -> list[Step]:
    results, figures = folder / "results", folder / "figures"
    return [
        Step(
            name,
            ("paper_figures", "draw", name, "--results", str(results), "--output", str(figures)),
            tuple(figures / f"{name}.{kind}" for kind in ("pdf", "svg", "png", "txt")),
            _csv(folder, *tables),
        )
        for name, tables in figure_tables().items()
    ]


def _summary(asked: Asked, made: Sequence[Step]) -> Step:
    folder, (tests, files) = asked.folder, asked.tests
    command = ("paper_figures", "summary", "--build", str(folder), "--", asked.chosen, *tests)
    outputs = tuple(folder / f"summary.{kind}" for kind in ("pdf", "svg", "png", "txt"))
    uses = tuple(path for step in made for path in (*step.outputs, step.refusal))
    return Step("summary", command, outputs, (*asked.model_files, *files), uses, is_vital=True)


def _csv(folder: Path, *names: str) -> tuple[Path, ...]:
    return tuple(folder / "results" / f"{name}.csv" for name in names)
