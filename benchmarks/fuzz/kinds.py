"""The kinds of cases: which files lie in the folder of a case, and which command line is given them."""

from __future__ import annotations

import io
import os
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path

import click
import numpy as np
import pyarrow

from benchmarks.fuzz import seeds
from benchmarks.fuzz.mutations import NUMBERS, WORDS, changed
from benchmarks.fuzz.outcome import ROOMS
from identification.base.axis_file import KEYS
from paper_figures.thesis.figure_registry import figure_module, figure_names


@dataclass(frozen=True)
class Case:
    """A command line and the files that it finds, by their paths in the folder in which it runs.

    Parameters
    ----------
    arguments
        The room first.
    files
        Contents by paths.
    others
        What no file holds: by its path a link (``-> TARGET``), ``folder`` or ``pipe``.
    """

    arguments: tuple[str, ...]
    files: Mapping[str, bytes]
    others: Mapping[str, str] = field(default_factory=dict)

    def lay_out(self, folder: Path) -> None:
        """Make the folder's content."""
        (folder / "out").mkdir()
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        for name, what in self.others.items():
            path = folder / name
            if what == "folder":
                path.mkdir()
            elif what == "pipe":
                os.mkfifo(path)
            else:
                path.symlink_to(what.removeprefix("-> "))


Maker = Callable[[random.Random, bool], Case]
"""Makes a case of a kind from random numbers; the flag says whether it has to cost little."""

SIMULATE = ("--limit", "12", "--anti-windup", "corrected", "--amplitude", "50", "--until", "0.2", "--output", "run.csv")
BODE = ("paper_figures", "bode", "model.json", "sweep.csv", "--output", "out")
CHECK = ("antiwindup", "check", "model.json")
SMALL = ("--modes", "1", "--real", "0", "--integrators", "1", "--bound-order", "1")


def sweeps(rng: random.Random, cheap: bool) -> Case:
    """A damaged file of sweeps."""
    name, content = rng.choice(sorted(seeds.sweeps().items()))
    damaged = changed(content, Path(name).suffix, rng)
    if name.endswith(".npz") and rng.random() < 0.5:
        damaged = _members_changed(content, rng)
    commands = [("readers", "sweeps", name)]
    if not cheap:
        commands += [
            ("identification", "fit", name, *SMALL, "--output", "model_2.json", "--responses", "kept.npz"),
            ("experiments", "thesis", "additive-error", "model.json", name, "--output", "out"),
            (*CHECK, name, "--junit", "check.xml", "--markdown", "check.md"),
            ("paper_figures", "bode", "model.json", name, "--output", "out"),
        ]
    return Case(rng.choice(commands), {**seeds.models(), name: damaged})


def models(rng: random.Random, cheap: bool) -> Case:
    """A damaged model.json."""
    _, content = rng.choice(sorted(seeds.models().items()))
    files = {"model.json": changed(content, ".json", rng), "sweep.csv": seeds.sweeps()["sweep.csv"]}
    commands: list[tuple[str, ...]] = [("readers", "model", "model.json")]
    if not cheap:
        options = ("--reference-omega", "1.5", "--a", "4", "--e", "2", "--f", "1", "--output", "design.json")
        commands += [
            ("design", "extended", "model.json", *options),
            (
                "design",
                "delay-free",
                "model.json",
                "--reference-hz",
                "0.25",
                "--epsilon",
                "1e-4",
                "--output",
                "design.json",
            ),
            ("paper_figures", "summary", "model.json", "sweep.csv", "--build", "out"),
            ("experiments", "thesis", "additive-error", "model.json", "sweep.csv", "--output", "out"),
            (*CHECK, "sweep.csv"),
            BODE,
        ]
    return Case(rng.choice(commands), files)


def designs(rng: random.Random, cheap: bool) -> Case:
    """A damaged design.json."""
    _, content = rng.choice(sorted(seeds.designs().items()))
    files = {"design.json": changed(content, ".json", rng)}
    own = ("--name", "mine", "--numerator=-25", "--denominator", "1 25", "--output", "design_2.json")
    commands: list[tuple[str, ...]] = [
        ("readers", "design", "design.json"),
        ("readers", "design", "design.json"),
        ("design", "anti-windup", "design.json", *own),
    ]
    if not cheap:
        commands += [
            ("design", "audit", "design.json"),
            ("experiments", "simulate", "design.json", *SIMULATE, "--sample-time", "0.01"),
            ("experiments", "sampled", "design.json", *SIMULATE, "--rate", "1000", "--method", "tustin"),
            ("antiwindup", "export", "design.json", "--to", "c", "--rate", "1000", "--limit", "12", "--output", "out"),
            ("experiments", "thesis", "f-gamma", "design.json", "--output", "out"),
            ("experiments", "thesis", "robustness", "design.json", "--output", "out"),
            ("experiments", "thesis", "interpolation", "design.json", "--output", "out"),
        ]
    return Case(rng.choice(commands), files)


def tables(rng: random.Random, cheap: bool) -> Case:
    """A damaged table of results, drawn or summed up; the ledger, its counts, or a sampled reference."""
    if rng.random() < 0.1:
        return _ledger(rng)
    kept = seeds.tables()
    if not cheap and rng.random() < 0.2:
        return _summary(rng)
    if cheap and rng.random() < 0.96:
        name = rng.choice(sorted(kept))
        return Case(("readers", "table", name), {name: changed(kept[name], ".csv", rng)})
    figures = {name: figure_module(name).TABLES for name in figure_names()}
    drawn = [name for name, needed in figures.items() if needed and all(f"{each}.csv" in kept for each in needed)]
    name = rng.choice(drawn)
    files = {f"results/{each}.csv": kept[f"{each}.csv"] for each in figures[name]}
    damaged = rng.choice(sorted(files))
    files[damaged] = changed(files[damaged], ".csv", rng)
    return Case(("paper_figures", "draw", name, "--results", "results", "--output", "out"), files)


def _ledger(rng: random.Random) -> Case:
    from experiments.thesis.claims.coverage import RECORD
    from experiments.thesis.claims.ledger import LEDGER

    command, content, suffix = rng.choice(
        (
            ("claims", LEDGER.read_bytes(), ".csv"),
            ("coverage", RECORD.read_bytes(), ".json"),
            ("reference", REFERENCE, ".csv"),
        )
    )
    return Case(("readers", command, f"file{suffix}"), {f"file{suffix}": changed(content, suffix, rng)})


def _summary(rng: random.Random) -> Case:
    files = {"model.json": seeds.models()["model.json"], "sweep.csv": seeds.sweeps()["sweep.csv"]}
    files |= {f"out/{name}": content for name, content in seeds.designs().items()}
    names = ("delay_free", "extended", "f_gamma", "robustness")
    files |= {f"out/results/{name}_summary.csv": seeds.tables()[f"{name}_summary.csv"] for name in names}
    damaged = rng.choice(sorted(files))
    files[damaged] = changed(files[damaged], Path(damaged).suffix, rng)
    return Case(("paper_figures", "summary", "model.json", "sweep.csv", "--build", "out"), files)


def campaigns(rng: random.Random, cheap: bool) -> Case:
    """A damaged parquet file of a campaign: its bytes, or a cell or a column of its rows."""
    if rng.random() < 0.5:
        damaged = changed(rng.choice(sorted(seeds.campaigns().values())), ".parquet", rng)
    else:
        table = seeds.campaign_table().astype(object)
        column = rng.randrange(table.shape[1])
        value = rng.choice((None, -1, 0, 1, 10**12, 0.5, 1e300, -0.0, np.nan, np.inf, True, "none", "\x1b", b"\xff"))
        rows = [rng.randrange(len(table))] if rng.random() < 0.7 else list(range(len(table)))
        if table.columns[column] == "guaranteed_sector" and value == np.inf:
            value = 1.0  # every sector may be guaranteed
        table.iloc[rows, column] = value
        if rng.random() < 0.2:
            table = table.drop(columns=table.columns[column])
        try:
            damaged = seeds.as_parquet(table.infer_objects())
        except (ValueError, TypeError, OverflowError, pyarrow.ArrowException):  # no file of a campaign holds that
            damaged = changed(seeds.campaigns()["raw.parquet"], ".parquet", rng)
    return Case(
        ("experiments", "campaign-tables", "campaign.parquet", "--output", "out"), {"campaign.parquet": damaged}
    )


def axes(rng: random.Random, cheap: bool) -> Case:
    """A damaged axis.toml: its bytes, or a line with an odd value."""
    lines = [f"{name} = {key.example}" for name, key in KEYS.items() if name != "reference"]
    if rng.random() < 0.5:
        name = rng.choice(sorted(KEYS))
        lines.append(f"{name} = {rng.choice((*NUMBERS, *WORDS, '[]', '[1, 2]', '[[1]]', '{a = 1}', '1979-05-27'))}")
    content = "\n".join(rng.sample(lines, rng.randrange(1, len(lines)))).encode("utf-8", "replace")
    if rng.random() < 0.5:
        content = changed(content, ".toml", rng)
    commands: list[tuple[str, ...]] = [("readers", "axis", "axis.toml")]
    if not cheap:
        commands += [("experiments", "axis", "model.json", "--axis", "axis.toml", "--output", "out")]
    return Case(rng.choice(commands), {"axis.toml": content, **seeds.models()})


def options(rng: random.Random, cheap: bool) -> Case:
    """Any command of any room with options that are right, odd, missing or given twice."""
    left_out = {*LONG, *(COSTLY if cheap else ())}
    words, command = rng.choice([each for each in commands() if each[0][-1] not in left_out])
    numbers = [each for each in command.params if not isinstance(each.type, click.Path | click.types.BoolParamType)]
    odd = rng.choice(numbers or command.params)
    arguments = list(words)
    for each in command.params:
        if rng.random() < (0.02 if each.required else 0.7) and each is not odd:
            continue
        value = _odd(rng) if each is odd else _right(each, words[-1], rng)
        if isinstance(each, click.Argument):
            arguments.append(value)
        elif isinstance(each, click.Option) and each.is_flag:
            arguments.append(each.opts[0])
        else:
            arguments += [f"{each.opts[0]}={value}"] * (rng.choice((1, 1, 1, 2)) if each.multiple else 1)
    files = {**seeds.models(), **seeds.designs(), **seeds.campaigns(), "sweep.csv": seeds.sweeps()["sweep.csv"]}
    return Case(tuple(arguments), files | {"reference.csv": REFERENCE})


REFERENCE = b"time_s,reference\n0,0\n1,2.5\n3,-1\n"

LONG = (
    *(
        "claims",
        "pid",
        "conditions",
        "wide-conditions",
        "limits",
        "campaign",
        "trade-off",
        "sampled-rates",
        "hidden-modes",
        "report",
    ),
    "rates",
    "equations",
)
"""Commands that take long whatever their options."""

COSTLY = (
    *("audit", "extended", "delay-free", "anti-windup", "tracking", "chapter-2", "chapter-4"),
    *("compare", "f-gamma", "interpolation", "robustness"),
)
"""Those that take more than a tenth of a second."""

RIGHT = {
    **{"design": "design_extended.json", "designs": "design_robust.json", "model": "model.json", "sweeps": "sweep.csv"},
    **{"campaign": "campaign.parquet", "names": "fig_2_02", "plant": "implied", "limit": "12"},
    **{"until": "0.2", "sample_time": "0.01", "rate": "1000", "anti_windup": "corrected", "amplitude": "50"},
    **{"omegas": "1.5", "a": "4", "e": "2", "f": "1", "epsilon": "1e-4", "method": "tustin"},
    **{"name": "mine", "numerator": "-25", "denominator": "1 25", "modes": "1", "real": "0", "integrators": "1"},
    **{"bound_order": "1", "bound_below": "0.5", "bound_above": "0.1"},
    **{"seed": "1", "sector": "0.9", "reference": "reference.csv", "loss": "soft-l1"},
}
"""What an option may be, by the name of its parameter."""


@cache
def commands() -> list[tuple[tuple[str, ...], click.Command]]:
    """Every command of the rooms, by its words; but for ``coverage``, which ends with 1 where a text says too much."""
    found: list[tuple[tuple[str, ...], click.Command]] = []
    for room in ROOMS:
        group: click.Group = import_module(f"{room}.__main__").main
        for name, command in group.commands.items():
            within = command.commands.items() if isinstance(command, click.Group) else ()
            found += [((room, name, each), one) for each, one in within if each != "coverage"]
            found += [] if within else [((room, name), command)]
    return found


def _odd(rng: random.Random) -> str:
    return rng.choice(NUMBERS if rng.random() < 0.8 else [word for word in WORDS if "\x00" not in word])


def _right(parameter: click.Parameter, command: str, rng: random.Random) -> str:
    if parameter.name in ("output", "build", "results"):
        is_folder = isinstance(parameter.type, click.Path) and not parameter.type.file_okay
        return "out" if is_folder else "written"
    if isinstance(parameter.type, click.Choice):
        return rng.choice(list(parameter.type.choices))
    if (parameter.name, command) == ("design", "chapter-2"):
        return "design_delay_free.json"
    return RIGHT.get(str(parameter.name), "1")


def paths(rng: random.Random, cheap: bool) -> Case:
    """An odd name for an input or an output of a command that needs little else."""
    odd = rng.choice(NAMES)
    if rng.random() < 0.3:
        odd = os.fsdecode(bytes(rng.choice(range(1, 256)) for _ in range(rng.randrange(1, 12))).replace(b"/", b"_"))
        if odd.startswith("-"):
            odd = f"./{odd}"
    suffix = rng.choice(("", ".csv", ".json", ".mat", ".npz", ".uff", ".parquet", ".txt"))
    name = odd + suffix if rng.random() < 0.5 else odd
    others = {"loop": "-> loop", "dangling": "-> nowhere", "pipe": "pipe", "empty": "folder", "link": "-> model.json"}
    files = {
        **seeds.models(),
        "sweep.csv": seeds.sweeps()["sweep.csv"],
        "design.json": seeds.designs()["design_extended.json"],
    }
    files["campaign.parquet"] = seeds.campaigns()["campaign.parquet"]
    command = rng.choice((*READING, *([] if cheap else LONGER)))
    if rng.random() < 0.4 and (
        "/" not in name and len(os.fsencode(name)) < 250 and name not in ("", ".", "..", *others)
    ):
        inside = next((each for each in command if each in files), "model.json")
        files[name] = files[inside]  # it is there, under this name
    place = rng.choice([k for k, each in enumerate(command) if each in PLACES])
    return Case(tuple(name if k == place else each for k, each in enumerate(command)), files, others)


NAMES = (
    *("", ".", "..", "/", "/dev/null", "/dev/zero", "/dev/full", "/dev/stdin", "/proc/self/mem", "/proc/self/status"),
    *("loop", "loop/a", "dangling", "pipe", "pipe/a", "empty", "link", "model.json", "model.json/a", "nowhere/a", "~"),
    *(
        "x" * 255,
        "x" * 256,
        "x" * 300,
        "/".join(["x" * 200] * 30),
        "a b",
        "a\nb",
        "\x1b[31m",
        "\udcff",
        "a\udc80b",
        "é",
    ),
    *("$x$", "$\\frac$", "%s", "{}", "&amp;<b>", "'", '"', "`ls`", "\u2028", "﻿", "﻿a", "_", "^", "\\", "*", "?"),
)
"""Names of files that are odd, or of what is no file."""

PLACES = ("FILE", "sweep.csv", "model.json", "design.json", "campaign.parquet", "out", "written")
READING: tuple[tuple[str, ...], ...] = (
    ("readers", "sweeps", "sweep.csv"),
    ("readers", "model", "model.json"),
    ("readers", "design", "design.json"),
    ("experiments", "campaign-tables", "campaign.parquet", "--output", "out"),
    (
        "design",
        "anti-windup",
        "design.json",
        "--name",
        "mine",
        "--numerator=-25",
        "--denominator",
        "1 25",
        "--output",
        "written",
    ),
    ("experiments", "thesis", "additive-error", "model.json", "sweep.csv", "--output", "out"),
    ("experiments", "simulate", "design.json", *SIMULATE[:-1], "written", "--sample-time", "0.1"),
    ("paper_figures", "draw", "fig_2_02", "--results", "out", "--output", "out"),
)
LONGER = (
    BODE,
    ("identification", "fit", "sweep.csv", *SMALL, "--output", "written", "--responses", "kept.npz"),
    ("paper_figures", "summary", "model.json", "sweep.csv", "--build", "out"),
    ("design", "delay-free", "model.json", "--reference-hz", "0.25", "--epsilon", "1e-4", "--output", "written"),
)


def _members_changed(content: bytes, rng: random.Random) -> bytes:
    """A member of a .npz changed in kind, shape or value."""
    with np.load(io.BytesIO(content)) as kept:
        members = dict(kept)
    name = rng.choice(sorted(members))
    value = members[name]
    options = [
        value[:1],
        value[..., None],
        np.array(rng.choice((1, 1.5, "a", b"\xff", True, 1e300, np.nan, -1.0, 1j))),
        value.astype(str),
        np.zeros(0),
        np.full(value.shape, np.nan),
        np.array([{"a": 1}], dtype=object),
        np.array(["2000-01-01"], dtype="datetime64"),
        np.zeros(10**6),
    ]
    members[name] = options[rng.randrange(len(options))]
    if rng.random() < 0.2:
        del members[name]
    written = io.BytesIO()
    np.savez(written, **members)
    return written.getvalue()


KINDS: dict[str, Maker] = {
    "sweeps": sweeps,
    "models": models,
    "designs": designs,
    "tables": tables,
    "campaigns": campaigns,
    "axes": axes,
    "options": options,
    "paths": paths,
}
