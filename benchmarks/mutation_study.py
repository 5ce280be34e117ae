"""What the strict snapshot fixture catches: every stored snapshot changed in every way, one change at a time.

    OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/mutation_study.py

The mutants are those of tests/snapshots/mutants.py, which tests/snapshots/test_mutations.py holds to. "Below" are
changes less than 1e-6 of the number, as of neighbours nearly equal, or less than the column's floor: what the
computation itself does not know. The second table says which columns have numbers whose change by 1e-6 is below it.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

from tqdm import tqdm

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "snapshots"))
from mutants import Tally, every_value, snapshot_files, stored_snapshot, tallied

SMALLEST = "a number 1e-6 of itself larger"


def main() -> int:
    """Print both tables; the exit status is 1 if a mutant was missed."""
    files = snapshot_files()
    total: dict[str, Tally] = defaultdict(Tally)
    for path in tqdm(files, disable=None, leave=False):
        for change, tally in tallied(path).items():
            total[change].mutants += tally.mutants
            total[change].caught += tally.caught
            total[change].below += tally.below
    print(f"{len(files)} files, {sum(path.stat().st_size for path in files) / 1e6:.1f} MB\n")
    print(f"{'change':<56}{'mutants':>10}{'caught':>10}{'below':>8}{'missed':>8}")
    for change, tally in sorted(total.items()):
        print(f"{change:<56}{tally.mutants:>10}{tally.caught:>10}{tally.below:>8}{tally.missed:>8}")
    print(f"\n{SMALLEST}, below the floor of its column:\n{'file':<30}{'column':<34}{'numbers':>9}{'below':>8}")
    for path in files:
        if path.suffix == ".npz":
            for change, column, below, caught in every_value(stored_snapshot(path)):
                if change == SMALLEST and not caught.all():
                    print(f"{path.name:<30}{column:<34}{len(below):>9}{(~caught).sum():>8}")
    return int(any(tally.missed for tally in total.values()))


if __name__ == "__main__":
    sys.exit(main())
