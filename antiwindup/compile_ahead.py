"""Compile, once for a machine and version, what the commands would compile as each first runs: two commands at once.

``python -m antiwindup.compile_ahead`` makes a small build in a temporary folder; what it compiles stays in the user's
cache folder, see :mod:`identification.base.compiled`.
"""

from __future__ import annotations

if __name__ == "__main__":
    from identification.base.process import begin

    begin()

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tqdm import tqdm

from antiwindup.build import Build, Crash
from antiwindup.steps import Step
from identification.base.command_line import Refusal
from identification.base.errors import InputError


def steps(folder: Path) -> list[Step]:
    """Commands that call all that takes long to compile; the first experiment compiles what the others wait for."""
    design, first = folder / "design.json", folder / "simulate.csv"
    given = ("--limit", "12", "--amplitude", "50")

    def experiment(name: str, file: Path, *words: str, after: tuple[Path, ...] = (first,)) -> Step:
        command = ("experiments", name, *given, *words, "--output", str(file), "--", str(design))
        return Step(name, command, (file,), (design, *after))

    extended = ("extended", "--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1", "--output", str(design))
    run = ("--until", "5")
    slewing = ("--rate-limit", "100", "--sample-time", "0.01", *run)
    return [
        Step("design", ("design", *extended, "--", "implied"), (design,)),
        experiment("simulate", first, "--sample-time", "0.01", *run, after=()),
        experiment("campaign", folder / "campaign.parquet", "--plants", "1", "--seed", "1", "--periods", "1"),
        experiment("simulate", folder / "slewing.csv", *slewing),
        Step(
            "limits",
            ("experiments", "limits", *given, "--output", str(folder), "--", str(design)),
            (folder / "limits_extended.csv", folder / "limits_extended_summary.csv"),
            (design, first),
        ),
        experiment("sampled", folder / "sampled.csv", "--rate", "1000", *run),
    ]


def main() -> None:
    """Run the steps, with a bar on a terminal."""
    with (
        TemporaryDirectory() as name,
        tqdm(bar_format="{desc}", disable=None, leave=False) as bar,
    ):
        every = steps(Path(name))
        build = Build(Path(name), every, [], every, goes_on=False, jobs=os.cpu_count() or 1)

        def tell(ended: int, running: Sequence[str]) -> None:
            bar.set_description_str(
                f"compiling, once for this machine, {ended + 1} of {build.runs}: {', '.join(running)}"
            )

        build.run(tell)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        Refusal(str(error)).show()
        sys.exit(Refusal.exit_code)
    except Crash as crash:
        sys.exit(str(crash))
