"""The documentation site builds without a warning, its tutorials run, and every link in it leads somewhere."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import jupytext
import nbformat
import pytest

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "docs/tutorial").glob("*_*.md"))
NOT_WORDS = {"pre", "code", "math", "script", "style"}


@dataclass
class Page(HTMLParser):
    """A page's title, its anchors, its links, and the words that a reader sees outside code and formulas."""

    title: str = ""
    anchors: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    inside: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        self.links += [given[name] for name in ("href", "src") if name in given]
        if tag in NOT_WORDS or tag == "title":
            self.inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if self.inside and tag == self.inside[-1]:
            self.inside.pop()

    def handle_data(self, data: str) -> None:
        if self.inside == ["title"]:
            self.title += data
        elif not self.inside:
            self.words.append(data)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    options = ("--quiet", "--fail-on-warning", "--keep-going", "-d", str(folder / "doctrees"))
    command = [sys.executable, "-m", "sphinx", *options, "docs", str(folder / "html")]
    own = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    found = {}
    for path in site.rglob("*.html"):
        if "_static" in path.parts:
            continue  # of the theme
        found[path] = page = Page()
        page.feed(path.read_text(encoding="utf-8"))
    return found


def test_every_local_link_leads_to_a_place(pages: dict[Path, Page]) -> None:
    lost, count = [], 0
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or not link:
                continue
            count += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchor = unquote(parts.fragment)
            if not target.exists() or (anchor and target in pages and anchor not in pages[target].anchors):
                lost.append(f"{path.name}: {link}")
    assert count > 10_000
    assert sorted(set(lost)) == []


def test_every_page_has_a_title_and_no_formula_is_left_as_it_is_typed(pages: dict[Path, Page]) -> None:
    assert len(pages) > 100
    assert [path.name for path, page in pages.items() if not page.title.strip()] == []
    written = {path: page for path, page in pages.items() if "api" not in path.parts}  # docstrings have no formulas
    assert [(path.name, words) for path, page in written.items() for words in page.words if "$" in words] == []


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_is_a_notebook_that_has_run(path: Path, site: Path) -> None:
    """And its page has the pictures and the numbers that the cells made."""
    notebook = jupytext.read(path)
    nbformat.validate(notebook)
    assert notebook.metadata["kernelspec"]["name"] == "python3"
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) >= 8
    text = (site / "tutorial" / f"{path.stem}.html").read_text(encoding="utf-8")
    pictures = sum("paper_figures.plot" in cell.source for cell in cells)
    assert text.count('src="../_images/') == pictures >= 2


def test_the_tutorials_come_to_what_they_say(site: Path) -> None:
    own = (site / "tutorial/your_own_axis.html").read_text(encoding="utf-8")
    assert "Nothing to do: the sweep lies within W_a" in own
    assert "the frequency of pole mode 1 moved by -10 %" in own
    thesis = (site / "tutorial/thesis_in_ten_minutes.html").read_text(encoding="utf-8")
    assert thesis.count("35.798") >= 3  # the offset of the table, of the run and by the formula
