"""A small build folder for the tests of the report, and what its page holds."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from html.parser import HTMLParser
from pathlib import Path

import click
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from design.__main__ import main as design
from experiments.__main__ import main as experiments
from identification.__main__ import main as identification
from paper_figures import __main__ as command_line
from paper_figures.thesis import figure_registry

ROOT = Path(__file__).resolve().parents[2]
SWEEPS = [ROOT / "data" / "elevation" / "synthetic_test_1_frf.csv"]

FIGURES = ["fig_2_01", "fig_2_10", "fig_2_11", "fig_2_12"]
"""A block diagram, two of the same tables, and one whose design was refused."""

REFUSAL = "the plant has <no> dead time & more"
BREAKING_OUT = "# </script><!-- \u00e9 \u2028 & \r\n"
"""A comment in a table that would break a page in which it stood as it is."""


def invoke(command: click.Group, *arguments: object) -> Result:
    """What a command answers."""
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


def copied_build(folders: pytest.TempPathFactory) -> Path:
    """A folder with its own copy of what the first worker that needed it has built."""
    base = folders.getbasetemp()
    shared = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / "report_build"
    if not shared.exists():
        own = folders.mktemp("built") / "build"
        make_build(own)
        with suppress(OSError):  # another worker was first
            own.rename(shared)
    return shutil.copytree(shared, folders.mktemp("report") / "build")


def make_build(build: Path) -> None:
    """Fit, design, tabulate and draw what the figures need; the computed values of the ledger are made up."""
    for folder in ("results", "figures"):
        (build / folder).mkdir(parents=True)
    free = ("--reference-omega", 1.5, "--a", 4, "--e", 2, "--f", 1)
    extended, results = build / "design_extended.json", build / "results"
    for command, *arguments in (
        (identification, "fit", *SWEEPS, "--modes", 2, "--integrators", 1, "--output", build / "model.json"),
        (design, "extended", build / "model.json", *free, "--output", extended),
        (experiments, "thesis", "f-gamma", extended, "--output", results),
        (command_line.main, "draw", *FIGURES[:-1], "--results", results, "--output", build / "figures"),
    ):
        result = invoke(command, *arguments)
        assert result.exit_code == 0, result.output
    for name in ("delay_free", "robust"):
        (build / f"design_{name}.refused.txt").write_text(f"{REFUSAL}.\n", encoding="utf-8")
    table = results / "f_gamma_summary.csv"
    table.write_bytes(BREAKING_OUT.encode() + table.read_bytes())
    made_up_ledger().to_csv(build / "claims.csv", index=False)


def made_up_ledger() -> pd.DataFrame:
    """The thesis's claims with computed values and verdicts that nothing has computed."""
    ledger = pd.read_csv(ROOT / "data" / "thesis" / "claims.csv", dtype=str, keep_default_na=False)
    ledger = ledger.drop(columns="evidence", errors="ignore").assign(reason="", evidence="", tolerance="0.0005")
    ledger["computed"] = [f"{1.5 * (-1) ** i * 1.37 ** (i % 40):.12g}" for i in range(len(ledger))]
    ledger["verdict"] = ledger["kind"].where(ledger["kind"] == "input", "agrees")
    for start, verdict in ((3, "differs"), (7, "not_reproducible"), (11, "unchecked")):
        rows = ledger.index[start::23]
        ledger.loc[rows, "verdict"] = verdict
        ledger.loc[rows, "reason"] = f"made up for this test: {verdict}, <i>a</i> < b & \\frac{{1}}{{2}}"
        ledger.loc[rows, "evidence"] = "tests/claims/test_evidence.py::test_a tests/claims/test_evidence.py::test_b"
    ledger.loc[ledger["verdict"] == "not_reproducible", ["computed", "tolerance"]] = ""
    return ledger


def report(build: Path, *sweeps: Path, model: str = "") -> Result:
    """What the command answers, asked for the few figures alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure_registry, "figure_names", lambda: FIGURES)
        return invoke(command_line.main, "report", model or build / "model.json", *sweeps, "--build", build)


class Page(HTMLParser):
    """The parts of a page that the tests ask for.

    Attributes
    ----------
    rows
        Of the ledger, each as a dictionary from the name of the column to the text.
    pictures
        Attributes of each <img>.
    tables, svgs
        Name and text of each embedded table and picture, as it stands in the page.
    ids
        Every id.
    text
        All text outside of scripts and styles.
    """

    def __init__(self, html: str) -> None:
        super().__init__()
        self.rows: list[dict[str, str]] = []
        self.pictures: list[dict[str, str | None]] = []
        self.tables: list[tuple[str, str]] = []
        self.svgs: list[tuple[str, str]] = []
        self.ids: list[str] = []
        self.text = ""
        self._inside: list[str] = []
        self._cell = self._tag = ""
        self._held: list[tuple[str, str]] | None = None
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what begins."""
        given = dict(attrs)
        if "id" in given:
            self.ids.append(given["id"] or "")
        if tag == "img":
            self.pictures.append(given)
        if tag in ("script", "style"):
            self._inside.append(tag)
            self._held = {"table": self.tables, "svg": self.svgs}.get(given.get("class") or "")
            if self._held is not None:
                self._held.append((given.get("data-table") or given.get("data-picture") or "", ""))
        if tag == "tr" and "data-verdict" in given:
            self.rows.append({})
        if "data-label" in given:
            self._cell, self._tag = given["data-label"] or "", tag
        if self._cell == "quote" and "data-source" in given:
            self.rows[-1]["quote"] = given["data-source"] or ""

    def handle_endtag(self, tag: str) -> None:
        """Note what ends."""
        if tag in ("script", "style"):
            self._inside.pop()
        if tag == self._tag:
            self._cell = ""

    def handle_data(self, data: str) -> None:
        """Note the text."""
        if self._inside:
            if self._inside[-1] == "script" and self._held is not None:
                self._held[-1] = (self._held[-1][0], data)
            return
        self.text += data
        if self._cell not in ("", "quote"):
            self.rows[-1][self._cell] = self.rows[-1].get(self._cell, "") + data
