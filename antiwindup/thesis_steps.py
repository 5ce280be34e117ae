"""The steps of the thesis's figures and of the report: one model, under the thesis's references and choices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from antiwindup.code_files import figure_tables
from antiwindup.steps import Asked, Step, campaign_tables, csv_files, fit_steps, pictures


def thesis_steps(asked: Asked) -> list[Step]:
    """What every figure of the thesis, and of ours, is drawn from, for one model; and the figures.

    Of steps that could begin, the first begins: what takes longest comes first, so that no processor waits at the end.
    """
    conditions, figures = _tables(asked.folder, "conditions"), _figures(asked.folder)
    return [conditions, *fit_steps(asked), *_designs(asked), *_experiments(asked), *figures]


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


def _designs(asked: Asked) -> list[Step]:
    """With the thesis's references and free parameters; robust has a roll-off, so that W_a guarantees its stability."""
    extended = ("extended", "--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1")
    commands = {
        "extended": extended,
        "delay_free": ("delay-free", "--reference-hz", "0.25", "--epsilon", "1e-4"),
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
    results, (compare, additive) = str(folder / "results"), ("compare", "additive-error")
    return [
        Step("campaign", ("experiments", "thesis", "campaign", *plants, "--", str(extended)), (campaign,), (extended,)),
        _tables(folder, "limits", extended, stem="limits_extended"),
        _tables(folder, "limits", delay_free, stem="limits_delay_free"),
        _tables(folder, "hidden-modes", extended, options=limit),
        _tables(folder, "sampled-rates", extended, options=limit, stem="sampled"),
        _tables(folder, "trade-off", extended),
        _tables(folder, "f-gamma", extended),
        Step(
            compare,
            ("experiments", "thesis", compare, *limit, "--output", results, "--", str(extended)),
            csv_files(folder, "compare", "compare_runs"),
            (extended,),
        ),
        _tables(folder, "interpolation", extended, more=("interpolation_map",)),
        _tables(folder, "chapter-4", extended, options=limit, stem="extended"),
        _tables(folder, "chapter-2", delay_free, options=limit, stem="delay_free"),
        _tables(folder, "robustness", extended, robust),
        _tables(folder, "pid"),
        Step(
            additive,
            ("experiments", "thesis", additive, "--output", results, "--", asked.chosen, *tests),
            csv_files(folder, "additive_error", "additive_error_summary"),
            (*asked.model_files, *files),
        ),
        campaign_tables(folder),
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
    return Step(stem, command, csv_files(folder, stem, *more, f"{stem}_summary"), designs)


def _figures(folder: Path) -> list[Step]:
    results, figures = folder / "results", folder / "figures"
    return [
        Step(
            name,
            ("paper_figures", "draw", name, "--results", str(results), "--output", str(figures)),
            pictures(figures / name),
            csv_files(folder, *tables),
        )
        for name, tables in figure_tables().items()
    ]
