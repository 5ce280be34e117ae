"""The commands about the thesis's text: ``claims``, ``coverage`` and ``equations``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from experiments.tables import csv_writer
from identification.base.files import Content, read_text, write_whole
from identification.base.path_types import INPUT_FILE, OUTPUT_FILE, OUTPUT_FOLDER


@click.command("claims")
@click.option("--output", type=OUTPUT_FOLDER, required=True, help="Existing folder to write claims.csv to.")
@click.option("--page", type=OUTPUT_FILE, help="Write the page to this Markdown file.")
def claims_command(output: Path, page: Path | None) -> None:
    """Compute every claim of the thesis again.

    The command writes claims.csv, and with --page a page that shows each verdict.
    """
    from experiments.thesis.claims.coverage import EXCEPTIONS, RECORD, quotes_sha256, read_exceptions, read_record
    from experiments.thesis.claims.ledger import LEDGER, read_ledger, recompute
    from experiments.thesis.claims.page import claims_page

    ledger, record = read_ledger(), read_record()
    counted = record["ledger_sha256"] == quotes_sha256(ledger, read_exceptions())
    table = recompute(ledger)
    path = output / "claims.csv"
    contents: dict[Path, Content] = {path: csv_writer(table)}
    if page:
        contents[page] = claims_page(table, record, counted)
    write_whole(contents, [LEDGER, RECORD, EXCEPTIONS])
    click.echo(f"{len(table)} claims -> {path}")
    for verdict, count in table["verdict"].value_counts().items():
        click.echo(f"  {verdict:17s}{count:4d}")
    for row in table[table["verdict"] != table["status"]].itertuples():
        click.echo(f"  {row.id}: the ledger says {row.status}, recomputed it {row.verdict}")


@click.command("coverage")
@click.argument("text", type=INPUT_FILE)
@click.option("--record", type=OUTPUT_FILE, help="Write the counts to this JSON file.")
def coverage_command(text: Path, record: Path | None) -> None:
    """List the numbers of TEXT without a claim.

    TEXT is the text of the thesis. The exit status is 1 if there is such a number, or if a quote is not in TEXT.
    """
    from experiments.thesis.claims.coverage import (
        EXCEPTIONS,
        LEFT,
        coverage,
        coverage_record,
        quotes_missing_from,
        read_exceptions,
    )
    from experiments.thesis.claims.ledger import LEDGER, read_ledger

    content, ledger, exceptions = read_text(text), read_ledger(), read_exceptions()
    covered = coverage(content, ledger, exceptions)
    counts = coverage_record(content, covered, ledger, exceptions)
    if record:
        write_whole({record: json.dumps(counts, indent=2) + "\n"}, [text, LEDGER, EXCEPTIONS])
    click.echo(f"{text}: {counts['numbers']} numbers")
    for status, count in counts["statuses"].items():
        click.echo(f"  {status:17s}{count:4d}")
    left, missing = covered[covered["status"] == LEFT], quotes_missing_from(content, ledger)
    for row in left.itertuples():
        click.echo(f"line {row.line}: {row.number} is quoted by no claim: {row.context}")
    for claim in missing:
        click.echo(f"{claim}: its quote does not stand in the text")
    if len(left) or missing:
        raise SystemExit(1)


@click.command("equations")
@click.option("--page", type=OUTPUT_FILE, required=True, help="Write the page to this Markdown file.")
def equations_command(page: Path) -> None:
    """Write the page of the thesis's equations.

    It has each equation, lemma, theorem, table and figure with its function and its test.
    """
    from experiments.thesis.claims.equations_page import EQUATIONS, equations_page, read_equations

    table = read_equations()
    write_whole({page: equations_page(table)}, [EQUATIONS])
    click.echo(f"{len(table)} labels -> {page}")
