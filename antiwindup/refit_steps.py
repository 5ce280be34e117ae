"""The steps of a refit: a plant of the user's, designed and run for what its axis has to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from antiwindup.steps import Asked, Step, campaign_tables, csv_files, fit_steps, pictures

FIGURES: dict[str, tuple[str, ...]] = {
    "nyquist": (),
    "sensitivity": (),
    "run": ("tracking", "tracking_summary"),
    "anti_windups": ("compare", "compare_runs"),
    "rates": ("rates",),
    "limits": ("limits_extended", "limits_extended_summary"),
    "campaign": ("campaign", "campaign_summary", "campaign_distance"),
}
"""Figures of a refit, and the tables that each is drawn from, beside the design."""


def refit_steps(asked: Asked) -> list[Step]:
    """Fit, axis, designs, tables and figures of the user's plant, and the page that sums them up as they come."""
    made = [_axis(asked), *_designs(asked.folder), *_tables(asked)]
    return [*fit_steps(asked), _bode(asked), *made, *_figures(asked.folder), _summary(asked, made)]


def _axis(asked: Asked) -> Step:
    """What the user said of the axis, and what follows for the rest from the fitted plant."""
    folder, model = asked.folder, asked.folder / "model.json"
    command = ("experiments", "axis", *asked.axis, "--output", str(folder), "--", str(model))
    return Step("axis", command, (folder / "axis.toml", folder / "axis.csv"), (model, *asked.axis_files))


def _designs(folder: Path) -> list[Step]:
    axis, model = folder / "axis.toml", folder / "model.json"
    commands = {"design": ("extended",), "design_delay_free": ("delay-free", "--integral-action")}
    return [
        Step(
            name.replace("_", " "),
            ("design", *words, "--axis", str(axis), "--output", str(folder / f"{name}.json"), "--", str(model)),
            (folder / f"{name}.json",),
            (model, axis),
        )
        for name, words in commands.items()
    ]


def _tables(asked: Asked) -> list[Step]:
    folder, design, axis = asked.folder, asked.folder / "design.json", asked.folder / "axis.toml"
    campaign = folder / "results" / "campaign.parquet"

    def of_design(name: str, output: Path, outputs: tuple[Path, ...], options: tuple[str, ...] = ()) -> Step:
        words = ("experiments", name, *options, "--axis", str(axis), "--output", str(output), "--", str(design))
        return Step(name, words, outputs, (design, axis, *asked.axis_files))

    results = folder / "results"
    return [
        of_design("tracking", results, csv_files(folder, "tracking", "tracking_summary")),
        of_design("compare", results, csv_files(folder, "compare", "compare_runs")),
        of_design("rates", results, csv_files(folder, "rates")),
        of_design("limits", results, csv_files(folder, "limits_extended", "limits_extended_summary")),
        of_design("campaign", campaign, (campaign,), ("--plants", str(asked.plants), "--seed", "1", "--anew")),
        campaign_tables(folder),
    ]


def _bode(asked: Asked) -> Step:
    """The fit, drawn."""
    figures, (tests, files) = asked.folder / "figures", asked.tests
    command = ("paper_figures", "bode", "--output", str(figures), "--", asked.chosen, *tests)
    return Step("bode", command, pictures(figures / "bode"), (*asked.model_files, *files))


def _figures(folder: Path) -> list[Step]:
    return [
        Step(
            f"figure {name}",
            ("paper_figures", "axis", name, "--refit", str(folder), "--output", str(folder / "figures")),
            pictures(folder / "figures" / name),
            (folder / "design.json", *csv_files(folder, *tables)),
        )
        for name, tables in FIGURES.items()
    ]


def _summary(asked: Asked, made: Sequence[Step]) -> Step:
    folder, (tests, files) = asked.folder, asked.tests
    command = ("paper_figures", "summary", "--build", str(folder), "--", asked.chosen, *tests)
    uses = tuple(path for step in made for path in (*step.outputs, step.refusal))
    needs, stages = (*asked.model_files, *files), ((), csv_files(folder, "tracking"))
    return Step("summary", command, pictures(folder / "summary"), needs, uses, is_vital=True, stages=stages)
