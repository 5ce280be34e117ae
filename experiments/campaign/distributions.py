"""The file of a Monte Carlo campaign -> distributions of peak error, steady error and recovery time (Fig. A.6)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from experiments.campaign.seal import SEAL, Seal
from experiments.runs.metrics import of_table
from identification.base.errors import InputError
from identification.base.files import require_readable

RUNS = ("none", "thesis", "corrected")
MEASURES = {"peak_error": "peak_error_{}", "steady_error": "steady_error_{}", "recovery_s": "recovery_{}_s"}
STEPS = 200  # of the plants' share, at which the distributions are tabulated
PERCENT = (5, 50, 95)  # of the plants, in the summary
BINS = 10  # of the distance
OUTCOMES = ("linear_stable", "diverged", "recovered", "covered")

ROWS = 8192  # that are held at a time
MOST_SAID = 200  # characters of what Arrow says
DIGIT = 8  # bits of the quantiles that one reading of the file settles

# The type that each column is read as; the measures may have empty cells.
COLUMNS = {
    "plant": "int64",
    "anti_windup": "string",
    "distance": "float64",
    "linear_stable": "bool",
    "diverged": "bool",
    "covered": "bool",
    "guaranteed_sector": "float64",
}
COLUMNS |= dict.fromkeys(MEASURES, "float64")
FACTS = {"plants": int, "seed": int, "lower_limit": float, "limit": float, "rate_limit": float, "horizon_s": float}

Columns = dict[str, np.ndarray]


def campaign_tables(path: Path) -> dict[str, pd.DataFrame]:
    """Sum up the file that ``python -m experiments campaign`` writes.

    Parameters
    ----------
    path
        Parquet, a row for each plant and anti-windup.

    Returns
    -------
    dict
        ``campaign``: for each anti-windup (run) and share of the plants (1/200 to 1) the peak_error, steady_error and
        recovery_s that so many of them do not exceed. ``campaign_distance``: for each run and each tenth of the
        distance (from, to) the number of plants there, the shares of them whose linear loop is stable (linear_stable),
        whose run diverges, recovers and is covered by its guarantee, and the least and the greatest peak error
        (least_peak_error, greatest_peak_error: empty of a run that diverges); empty where there is no plant.
        ``campaign_summary``: for each run plants, seed, lower_limit, limit, rate_limit (empty: none), horizon_s, the
        four shares among all plants, the guaranteed_sector (0: nothing is guaranteed of these plants), the 5, 50 and
        95 % quantiles of the three numbers, and worst_plant, that of the largest steady error; of several, such as
        those that diverge, the nearest to the model.

    Raises
    ------
    InputError
        The file is missing or not of that kind, lacks a column or rows, or holds what no campaign writes.

    Notes
    -----
    A run that diverges has errors beyond all others, and one that never recovers a time beyond all others, so that
    they count in every share; a quantile that falls among them is empty. Quantiles are values of the sample: of n
    plants, that of share p is the ceil(p n)-th.
    """
    facts = _facts(path)
    _require_sealed(path)
    counts, peaks, sectors, worst = _count(path, facts["plants"])
    steps = np.arange(1, STEPS + 1)
    values = _order_statistics(path, -(-steps * facts["plants"] // STEPS) - 1)
    quantiles = np.where(np.isfinite(values), values, np.nan)
    edges = np.linspace(0.0, 1.0, BINS + 1)
    distributions, distances, rows = [], [], []
    for name, of_run, count, ends, sector, plant in zip(RUNS, quantiles, counts, peaks, sectors, worst, strict=True):
        measured = dict(zip(MEASURES, of_run, strict=True))
        distributions.append(pd.DataFrame({"run": name, "share": steps / STEPS} | measured))
        plants, *outcomes = count
        shares = {what: part / np.where(plants, plants, np.nan) for what, part in zip(OUTCOMES, outcomes, strict=True)}
        shares |= dict(zip(("least_peak_error", "greatest_peak_error"), ends, strict=True))
        distances.append(pd.DataFrame({"run": name, "from": edges[:-1], "to": edges[1:], "plants": plants} | shares))
        row = {"run": name} | facts | {"rate_limit": of_table(facts["rate_limit"])}
        row |= {what: part.sum() / facts["plants"] for what, part in zip(OUTCOMES, outcomes, strict=True)}
        row["guaranteed_sector"] = sector
        for measure, form in MEASURES.items():
            row |= {form.format(percent): measured[measure][percent * STEPS // 100 - 1] for percent in PERCENT}
        rows.append(row | {"worst_plant": plant})
    return {
        "campaign": pd.concat(distributions, ignore_index=True),
        "campaign_distance": pd.concat(distances, ignore_index=True),
        "campaign_summary": pd.DataFrame(rows),
    }


@contextmanager
def _reading(path: Path) -> Iterator[Any]:
    """The file, open; a damaged one makes Arrow raise whatever it comes upon: its own errors, wrong text, no memory."""
    from pyarrow import parquet

    require_readable(path)
    try:
        with path.open("rb") as opened:  # Arrow takes no name that is not UTF-8
            yield parquet.ParquetFile(opened)
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: cannot be read ({reason[:MOST_SAID]}); expected the file of a campaign") from None


def _facts(path: Path) -> dict[str, Any]:
    """What the file says of the whole campaign, once its columns are there."""
    with _reading(path) as file:
        names, said = file.schema_arrow.names, file.schema_arrow.metadata or {}
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; expected the file of a campaign, with {', '.join(COLUMNS)}")
    twice = [name for name in COLUMNS if names.count(name) > 1]
    if twice:
        raise InputError(f"{path}: holds the column {twice[0]} {names.count(twice[0])} times; expected it once")
    facts = {}
    for name, kind in FACTS.items():
        try:
            facts[name] = kind(said[name.encode()])
        except (KeyError, ValueError):
            raise InputError(f"{path}: its metadata give no {name}; expected the file of a campaign") from None
    for name, value in facts.items():
        if np.isnan(value):
            raise InputError(f"{path}: its {name} is nan; expected a number")
    if facts["plants"] < 1:
        raise InputError(f"{path}: no plants; expected at least one")
    return facts


def _require_sealed(path: Path) -> None:
    """Refuse a file whose rows and metadata are not those that were written, see :mod:`experiments.campaign.seal`."""
    with _reading(path) as file:
        seal = Seal(file.schema_arrow)
        for batch in file.iter_batches(batch_size=ROWS):
            seal.update(batch)
        said = (file.schema_arrow.metadata or {}).get(SEAL.encode(), b"").decode()
    if said != str(seal):
        raise InputError(f"{path}: was changed after the campaign, as its {SEAL} shows; expected an unchanged file")


def _read(path: Path) -> Iterator[Columns]:
    """The columns, a piece at a time: ``run`` counts in RUNS, and what diverges or never recovers is infinite."""
    with _reading(path) as file:
        for batch in file.iter_batches(batch_size=ROWS, columns=list(COLUMNS)):
            piece = {}
            for name, kind in COLUMNS.items():
                cells = batch.column(name)
                if name not in MEASURES and cells.null_count:
                    raise InputError(f"{path}: {name} has an empty cell; expected none")
                piece[name] = cells.cast(kind).to_numpy(zero_copy_only=False)
            yield _checked(path, piece)


def _checked(path: Path, piece: Columns) -> Columns:
    """The columns of :func:`_read`, if a campaign can have written them."""
    run = np.full(len(piece["plant"]), -1)
    for number, name in enumerate(RUNS):
        run[piece["anti_windup"] == name] = number
    if (run < 0).any():
        found = piece["anti_windup"][run < 0][0]
        raise InputError(f"{path}: an anti_windup is '{found}'; expected {', '.join(RUNS)}")
    if not ((piece["distance"] >= 0) & (piece["distance"] <= 1 + 1e-9)).all():
        raise InputError(f"{path}: a distance is not between 0 and 1; expected plants within W_a")
    measured = {}
    for name in MEASURES:
        values = np.where(np.isnan(piece[name]), np.inf, piece[name]) + 0.0  # not -0
        wrong = (values < 0) | (np.isinf(values) & ~piece["diverged"] & (name != "recovery_s"))
        if wrong.any():
            plant, given = piece["plant"][wrong][0], piece[name][wrong][0]
            raise InputError(
                f"{path}: {name} of plant {plant} is {given:g}; expected 0 or more, or a run that diverges"
            )
        measured[name] = np.where(piece["diverged"], np.inf, values)
    return piece | measured | {"run": run}


def _count(path: Path, plants: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[int]]:
    """How many plants, and with each of OUTCOMES, by (run, which of five, bin); peaks; each run's sector, worst plant.

    The peaks are the least and the greatest peak error by (run, which of two, bin), NaN where there is none.
    """
    counts = np.zeros((len(RUNS), 1 + len(OUTCOMES), BINS), dtype=np.int64)
    peaks = np.full((len(RUNS), 2, BINS), np.inf) * [[1.0], [-1.0]]
    sectors = np.full((2, len(RUNS)), np.nan)  # the least and the largest, which are one
    worst = [(-1.0, 0.0, 0)] * len(RUNS)  # steady error, -distance, -plant
    for piece in _read(path):
        bins = np.minimum((BINS * piece["distance"]).astype(np.int64), BINS - 1)
        recovered = np.isfinite(piece["recovery_s"])
        every = np.full(len(bins), True)
        outcomes = (every, piece["linear_stable"], piece["diverged"], recovered, piece["covered"])
        for k, what in enumerate(outcomes):
            np.add.at(counts[:, k], (piece["run"][what], bins[what]), 1)
        np.minimum.at(peaks[:, 0], (piece["run"], bins), piece["peak_error"])
        np.maximum.at(peaks[:, 1], (piece["run"], bins), piece["peak_error"])
        for run in range(len(RUNS)):
            own = piece["run"] == run
            order = np.column_stack([piece["steady_error"], -piece["distance"], -piece["plant"]])[own]
            if len(order):
                given = piece["guaranteed_sector"][own]
                sectors[:, run] = np.fmin(sectors[0, run], given.min()), np.fmax(sectors[1, run], given.max())
                worst[run] = max(worst[run], tuple(order[np.lexsort(order.T[::-1])[-1]]))
    for name, found in zip(RUNS, counts[:, 0].sum(axis=1), strict=True):
        if found != plants:
            raise InputError(f"{path}: {found} rows with anti_windup {name}; expected one for each of {plants} plants")
    if (sectors[0] != sectors[1]).any():
        raise InputError(f"{path}: an anti_windup has several values of guaranteed_sector; expected one")
    return counts, np.where(np.isfinite(peaks), peaks, np.nan), sectors[1], [int(-plant) for _, _, plant in worst]


def _order_statistics(path: Path, ranks: np.ndarray) -> np.ndarray:
    """The values of these ranks, 0 the least, among those of each run and measure: (run, measure, rank).

    Notes
    -----
    Exact, though no more than ROWS rows are held at a time. Numbers that are not negative sort as their bits do, read
    as whole numbers: each reading of the file counts, among the values whose leading bits are those of a wanted one,
    how many have which next DIGIT bits.
    """
    leading = np.zeros((len(RUNS), len(MEASURES), len(ranks)), dtype=np.uint64)
    rank = np.broadcast_to(ranks, leading.shape).copy()  # among the values with the same leading bits
    for shift in range(64 - DIGIT, -1, -DIGIT):
        counts = np.zeros((*leading.shape, 2**DIGIT), dtype=np.int64)
        for piece in _read(path):
            for run in range(len(RUNS)):
                for k, measure in enumerate(MEASURES):
                    bits = piece[measure][piece["run"] == run].view(np.uint64) >> np.uint64(shift)
                    counts[run, k] += _next_digits(bits, leading[run, k])
        before = np.cumsum(counts, axis=-1)
        digit = np.sum(before <= rank[..., None], axis=-1)
        rank -= np.take_along_axis(before - counts, digit[..., None], axis=-1)[..., 0]
        leading = (leading << np.uint64(DIGIT)) | digit.astype(np.uint64)
    return leading.view(np.float64)


def _next_digits(bits: np.ndarray, leading: np.ndarray) -> np.ndarray:
    """How many of ``bits`` begin with each of ``leading``, by what digit they end with: (leading, digit)."""
    heads, last = bits >> np.uint64(DIGIT), bits & np.uint64(2**DIGIT - 1)
    distinct, which = np.unique(leading, return_inverse=True)
    place = np.minimum(np.searchsorted(distinct, heads), len(distinct) - 1)
    found = distinct[place] == heads
    index = place[found] * 2**DIGIT + last[found].astype(np.int64)
    counts = np.bincount(index, minlength=len(distinct) * 2**DIGIT).reshape(len(distinct), 2**DIGIT)
    return np.asarray(counts[which])
