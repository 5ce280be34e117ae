"""A step of a build, what a build is for, and the steps that every build has."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


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
    stages
        Some of the files that it uses, more in each stage: as soon as those of a stage are there, or refused, it is
        run on what there is by then; and once more at the end.
    """

    name: str
    command: tuple[str, ...]
    outputs: tuple[Path, ...]
    needs: tuple[Path, ...] = ()
    uses: tuple[Path, ...] = ()
    is_vital: bool = False
    stages: tuple[tuple[Path, ...], ...] = ()

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
    axis
        Options of ``experiments axis``: what is known of the user's axis.
    axis_files
        The files that these name.
    limit
        Saturation limits +-limit instead of the thesis's, where the thesis's figures are drawn.
    plants
        How many plants are drawn within W_a.
    """

    folder: Path
    model: str | None
    sweeps: tuple[str, ...]
    sweep_files: tuple[Path, ...]
    fit: tuple[str, ...] = ()
    axis: tuple[str, ...] = ()
    axis_files: tuple[Path, ...] = ()
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


def fit_steps(asked: Asked) -> list[Step]:
    """The fit of the sweeps; none where a model was asked for."""
    if asked.model is not None:
        return []
    model, responses = asked.folder / "model.json", asked.folder / "responses.npz"
    command = ("identification", "fit", *asked.fit, "--output", str(model), "--responses", str(responses))
    return [Step("fit", (*command, "--", *asked.sweeps), (model, responses), asked.sweep_files, is_vital=True)]


def campaign_tables(folder: Path) -> Step:
    """The distributions of a campaign."""
    campaign = folder / "results" / "campaign.parquet"
    return Step(
        "campaign-tables",
        ("experiments", "campaign-tables", "--output", str(folder / "results"), "--", str(campaign)),
        csv_files(folder, "campaign_distance", "campaign", "campaign_summary"),
        (campaign,),
    )


def pictures(stem: Path) -> tuple[Path, ...]:
    """The files of a figure with its caption."""
    return tuple(stem.with_name(f"{stem.name}.{kind}") for kind in ("pdf", "svg", "png", "txt"))


def csv_files(folder: Path, *names: str) -> tuple[Path, ...]:
    """Tables in the folder of a build."""
    return tuple(folder / "results" / f"{name}.csv" for name in names)
