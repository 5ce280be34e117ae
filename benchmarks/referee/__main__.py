"""Compare what the project says of random cases with the referee's own numerics, and print one table.

    make referee                                              all kinds, 200 cases, seed 1
    python -m benchmarks.referee --cases 50 --seed 7 --kinds margins,loop

A row says of one quantity in how many cases it was compared, how often the referee's own error left it undecided, the
worst disagreement, what is allowed there, and the case that shows it. Beside each check stands why it allows what it
allows: the accuracy that the project claims or the referee's own error, whichever is larger. Refusals are counted with
their sentences. The exit status is 1 when anything exceeds its allowance.
"""

from __future__ import annotations

import argparse
import re
import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from importlib import import_module

from tqdm import tqdm

from benchmarks.referee.cases import Case, Finding, case_of
from benchmarks.referee.winding import Undecided
from identification.base.errors import InputError

KINDS = ("margins", "roots", "conditions", "norms", "loop", "campaign", "sampled", "limits", "units")

Check = Callable[[Case], list[Finding]]


class Tally:
    """What the cases of one kind came to."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.cases = 0
        self.refused: Counter[str] = Counter()
        self.findings: dict[str, list[tuple[Finding, Case]]] = defaultdict(list)

    def judge(self, case: Case, check: Check) -> None:
        """Run one check; a refusal is counted, what the referee cannot decide too, any other error is a failure."""
        self.cases += 1
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                findings = check(case)
        except InputError as error:
            self.refused[re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?j?", "#", str(error))] += 1
            return
        except Undecided:
            findings = [Finding("undecided by the referee", 0.0, float("inf"))]
        except Exception as error:
            findings = [Finding(f"{type(error).__name__}: {error}"[:70], float("inf"), 1.0)]
        for finding in findings:
            self.findings[finding.quantity].append((finding, case))

    def rows(self) -> list[tuple[str, ...]]:
        """Kind, quantity, cases, undecided, beyond, worst, allowed, where."""
        found = []
        for quantity, pairs in self.findings.items():
            undecided = sum(finding.allowed == float("inf") for finding, _ in pairs)
            beyond = len({case for finding, case in pairs if finding.share > 1})
            worst, case = max(pairs, key=lambda pair: pair[0].share)
            numbers = (f"{worst.disagreement:.2g}", f"{worst.allowed:.2g}", f"{case.seed}/{case.index}")
            count = len({case for _, case in pairs})
            found.append((self.kind, quantity, str(count), str(undecided), str(beyond), *numbers))
        return found

    @property
    def fails(self) -> bool:
        """Whether anything exceeds what is allowed."""
        return any(finding.share > 1 for pairs in self.findings.values() for finding, _ in pairs)


def referee(seed: int, cases: int, kinds: Sequence[str], first: int = 0) -> list[Tally]:
    """Judge the cases ``first`` to ``first + cases`` - 1 of a seed."""
    checks: dict[str, Check] = {kind: import_module(f"benchmarks.referee.{kind}").check for kind in kinds}
    tallies = {kind: Tally(kind) for kind in kinds}
    for index in tqdm(range(first, first + cases), desc="referee", disable=None, leave=False):
        case = case_of(seed, index)
        for kind, check in checks.items():
            tallies[kind].judge(case, check)
    return list(tallies.values())


def table(tallies: Sequence[Tally]) -> str:
    """The rows of all kinds, and the sentences with which cases were refused."""
    head = ("kind", "quantity", "cases", "undecided", "beyond", "worst", "allowed", "where")
    rows = [head, *(row for tally in tallies for row in tally.rows())]
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    for tally in tallies:
        lines.append(f"{tally.kind}: {tally.cases} cases, {sum(tally.refused.values())} refused")
        lines += [f"  {count} times: {sentence}" for sentence, count in tally.refused.most_common()]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.referee", description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200, help="how many")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first case, to repeat one")
    parser.add_argument("--kinds", default=",".join(KINDS), help=f"of {','.join(KINDS)}")
    given = parser.parse_args(arguments)
    kinds = given.kinds.split(",")
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"--kinds has {', '.join(sorted(unknown))}; expected of {','.join(KINDS)}")
    tallies = referee(given.seed, given.cases, kinds, given.first)
    print(table(tallies))
    return int(any(tally.fails for tally in tallies))


if __name__ == "__main__":
    sys.exit(main())
