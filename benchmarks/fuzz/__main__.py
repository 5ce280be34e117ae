"""Give damaged files, odd numbers and odd names to every command, and print what became of them by kind.

    make fuzz                                                       all kinds, CASES cases each, of SEED
    python -m benchmarks.fuzz --cases 10000 --seed 1 --kind sweeps --keep build/fuzz

A command line is accepted (status 0, nothing on standard error, whole and finite outputs, the same bytes a second
time), refused (status 2, one printable sentence, nothing written), or a fault: anything else, and what takes longer
than --seconds. Each fault is kept as a folder that can be moved to benchmarks/fuzz/corpus, whose cases the test suite
repeats. The exit status is 1 when there is a fault.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from tqdm import tqdm

from benchmarks.fuzz.kinds import KINDS, Case
from benchmarks.fuzz.outcome import Outcome, run
from paper_figures.look import style

CORPUS = Path(__file__).with_name("corpus")
COMMAND = "command.json"
SECONDS = 30.0
AGAIN = 10  # every so many accepted cases are run twice


def fuzz(
    kind: str, cases: int, seed: int, seconds: float = SECONDS, cheap: bool = False
) -> Iterator[tuple[Case, Outcome]]:
    """The outcomes of so many cases of a kind; case i of a seed is the same whatever the number of cases.

    Where it has to be cheap, figures are drawn, but in no format.
    """
    with patch.dict(style._METADATA, clear=cheap):
        for number in range(cases):
            rng = random.Random(f"{kind} {seed} {number} {cheap}")
            case = KINDS[kind](rng, cheap)
            yield case, judged(case, seconds, again=rng.randrange(AGAIN) == 0)


def judged(case: Case, seconds: float, again: bool = False) -> Outcome:
    """Run a case in a folder that is then removed."""
    with TemporaryDirectory(prefix="fuzz-") as name:
        case.lay_out(Path(name))
        return run(case.arguments, Path(name), seconds, again)


def keep(case: Case, folder: Path) -> None:
    """Write a case as :func:`kept` reads it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in case.files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(case.files[name])
    content = {"arguments": case.arguments, "others": case.others}
    (folder / COMMAND).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def kept(folder: Path) -> Case:
    """A case that was kept."""
    content = json.loads((folder / COMMAND).read_text(encoding="utf-8"))
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    del files[COMMAND]
    return Case(tuple(content["arguments"]), files, content["others"])


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=500, help="how many of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS, action="append", help="repeatable; all unless given")
    parser.add_argument("--cheap", action="store_true", help="only what costs little, as in the test suite")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="a case that takes longer is a fault")
    parser.add_argument("--keep", type=Path, help="folder to keep the first case of each fault in")
    given = parser.parse_args(arguments)
    rows, places = [], Counter[tuple[str, str]]()
    for kind in given.kind or KINDS:
        found = Counter[str]()
        every = fuzz(kind, given.cases, given.seed, given.seconds, given.cheap)
        for case, outcome in tqdm(every, total=given.cases, desc=kind, disable=None, leave=False):
            found[outcome.kind] += 1
            if outcome.kind != "fault":
                continue
            places[kind, outcome.place] += 1
            if places[kind, outcome.place] == 1:
                print(f"{kind}: {outcome.place}\n  {case.arguments}\n{outcome.said}", flush=True)
                if given.keep:
                    keep(case, given.keep / kind / str(len(places)))
        rows.append((kind, *(found[each] for each in ("accepted", "refused", "fault"))))
    print(f"{'kind':<12}{'accepted':>10}{'refused':>10}{'faults':>10}")
    for kind, *counts in rows:
        print(f"{kind:<12}" + "".join(f"{count:>10}" for count in counts))
    for (kind, place), count in places.most_common():
        print(f"{count} times, {kind}: {place}")
    return int(bool(places))


if __name__ == "__main__":
    sys.exit(main())
