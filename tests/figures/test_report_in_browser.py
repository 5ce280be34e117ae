"""The report in a real browser: it loads and asks for nothing, filters, sorts, saves its data, and fits a phone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect
from report_build import BREAKING_OUT, FIGURES, SWEEPS, copied_build, report

from paper_figures.thesis.report.ledger import chapter_of

PHONE = {"width": 390, "height": 844}
SMALLEST = 12  # of letters [px]


@pytest.fixture(scope="module")
def build(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Path:
    build = copied_build(tmp_path_factory)
    result = report(build, *SWEEPS)
    assert result.exit_code == 0, result.output
    return build


@pytest.fixture(scope="module")
def address(build: Path) -> str:
    return (build / "report" / "index.html").as_uri()


@pytest.fixture(scope="module")
def ledger(build: Path) -> pd.DataFrame:
    ledger = pd.read_csv(build / "claims.csv", dtype=str, keep_default_na=False)
    return ledger.assign(chapter=ledger["where"].map(chapter_of))


class Watched:
    """A page, and what its browser complained of or asked for."""

    def __init__(self, browser: Browser, address: str, **settings: object) -> None:
        self.context = browser.new_context(
            viewport=settings.pop("viewport", {"width": 1280, "height": 900}), **settings
        )
        self.page: Page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("requestfailed", lambda request: self.complaints.append(f"failed: {request.url}"))
        self.page.goto(address)
        if settings.get("java_script_enabled", True):
            self.page.wait_for_function("document.querySelectorAll('img:not([src])').length === 0")

    def show_all(self) -> None:
        """Show every row of the ledger, which at first shows what differs."""
        self.page.get_by_role("button", name="Show all").click()

    def violations(self) -> list[str]:
        """What axe-core objects to, with few of the ledger's rows, which are all alike; and in the dark of colours."""
        self.page.locator("select[name=verdict]").select_option("unchecked")
        found = Axe().run(self.page).response["violations"]
        self.page.emulate_media(color_scheme="dark")
        found += Axe().run(self.page, options={"runOnly": ["color-contrast"]}).response["violations"]
        self.page.emulate_media(color_scheme="light")
        return [f"{each['id']}: {each['nodes'][0]['html']}" for each in found]

    def shown(self) -> list[str]:
        """The ids of the rows of the ledger that are shown, in their order."""
        script = """() => [...document.querySelectorAll("#claims tbody tr")]
            .filter((row) => row.checkVisibility()).map((row) => row.querySelector("td.id").textContent)"""
        return list(self.page.evaluate(script))

    def counts(self, said: str) -> None:
        """Wait until the page says how many there are."""
        expect(self.page.locator("#count")).to_have_text(said)


@pytest.fixture(scope="module")
def desk_page(browser: Browser, address: str) -> Iterator[Watched]:
    watched = Watched(browser, address)
    yield watched
    watched.context.close()


@pytest.fixture
def watched(desk_page: Watched, ledger: pd.DataFrame) -> Iterator[Watched]:
    """One page for all tests, since it takes a second to load: each finds it with every row and leaves it so."""
    desk_page.show_all()
    yield desk_page
    desk_page.show_all()
    desk_page.counts(f"{len(ledger)} of {len(ledger)} rows")
    assert not desk_page.complaints


@pytest.fixture(scope="module")
def phone_page(browser: Browser, address: str) -> Iterator[Watched]:
    watched = Watched(browser, address, viewport=PHONE, is_mobile=True, has_touch=True)
    yield watched
    watched.context.close()


@pytest.fixture
def phone(phone_page: Watched) -> Iterator[Watched]:
    yield phone_page
    assert not phone_page.complaints


def searched(ledger: pd.DataFrame, *asked: str) -> pd.Series:
    """Whether the text of each row holds all the words."""
    columns = ["id", "where", "quote", "printed", "unit", "kind", "touches", "verdict", "reason", "evidence"]
    text = ledger[columns].agg("\n".join, axis=1).str.lower()
    found = pd.Series(True, index=ledger.index)
    for word in asked:
        found &= text.str.contains(word.lower(), regex=False)
    return found


def test_loads_without_a_request_or_a_complaint(watched: Watched, address: str) -> None:
    watched.page.wait_for_load_state("networkidle")
    assert {url.partition("#")[0] for url in watched.requests if not url.startswith(("data:", "blob:"))} == {address}
    assert watched.page.title().startswith("Report")


def test_no_picture_is_missing(watched: Watched) -> None:
    script = """() => Promise.all([...document.images].map((image) => image.decode().then(
        () => [image.complete, image.naturalWidth, image.getBoundingClientRect().width, image.alt])))"""
    pictures = watched.page.evaluate(script)
    assert len(pictures) == len(FIGURES) - 1
    for complete, natural, width, alt in pictures:
        assert complete
        assert natural > 0
        assert width > 300
        assert alt.startswith("Fig. ")


@pytest.mark.parametrize("column", ["verdict", "kind", "chapter"])
def test_each_filter_shows_exactly_its_rows(watched: Watched, ledger: pd.DataFrame, column: str) -> None:
    for value in sorted(set(ledger[column]) - {""}):
        watched.page.locator(f"select[name={column}]").select_option(value)
        expected = list(ledger["id"][ledger[column] == value])
        watched.counts(f"{len(expected)} of {len(ledger)} rows")
        assert watched.shown() == expected
    watched.show_all()
    watched.counts(f"{len(ledger)} of {len(ledger)} rows")
    assert watched.shown() == list(ledger["id"])


def test_the_search_takes_any_words_of_a_row(watched: Watched, ledger: pd.DataFrame) -> None:
    box = watched.page.get_by_role("searchbox", name="Search")
    for text in ("GAMMA", "\\frac{1}", "test_evidence.py rad/s", "<i>a</i>", "  section   pid ", "no row has this"):
        box.fill(text)
        expected = list(ledger["id"][searched(ledger, *text.split())])
        watched.counts(f"{len(expected)} of {len(ledger)} rows")
        assert watched.shown() == expected
    assert not watched.shown()


def test_filters_add_up_and_stand_in_the_address(watched: Watched, ledger: pd.DataFrame, address: str) -> None:
    watched.page.locator("select[name=kind]").select_option("result")
    watched.page.locator("select[name=chapter]").select_option("2")
    watched.page.get_by_role("searchbox", name="Search").fill("s^2 &")
    chosen = (ledger["kind"] == "result") & (ledger["chapter"] == "2") & searched(ledger, "s^2", "&")
    assert watched.shown() == list(ledger["id"][chosen])
    assert watched.shown()
    there = watched.page.url
    assert there.startswith(f"{address}#ledger?")
    watched.page.goto("about:blank")
    watched.page.goto(there)
    assert watched.shown() == list(ledger["id"][chosen])
    assert watched.page.get_by_role("searchbox", name="Search").input_value() == "s^2 &"


def test_a_tile_leads_to_its_rows(watched: Watched, ledger: pd.DataFrame) -> None:
    tiles = watched.page.locator(".tiles a")
    counts = ledger["verdict"].value_counts()
    assert tiles.count() == len(counts)
    for verdict, count in counts.items():
        watched.page.evaluate("scrollTo(0, 0)")
        tile = tiles.filter(has=watched.page.get_by_text(str(verdict).replace("_", " "), exact=True))
        assert tile.locator("b").inner_text() == str(count)
        tile.click()
        expect(watched.page.locator("select[name=verdict]")).to_have_value(str(verdict))  # after the event hashchange
        assert watched.shown() == list(ledger["id"][ledger["verdict"] == verdict])
        assert watched.page.evaluate("Math.abs(document.getElementById('ledger').getBoundingClientRect().top) < 100")


def test_an_unknown_filter_in_the_address_shows_all(browser: Browser, address: str, ledger: pd.DataFrame) -> None:
    watched = Watched(browser, f"{address}#ledger?verdict=nonsense&other=1")
    watched.counts(f"{len(ledger)} of {len(ledger)} rows")
    watched.context.close()
    assert not watched.complaints


def test_a_head_sorts_up_and_down_and_back(watched: Watched, ledger: pd.DataFrame) -> None:
    head = watched.page.locator("#claims thead th.computed")
    numbers = pd.to_numeric(ledger["computed"])
    known, unknown = ledger[numbers.notna()], list(ledger["id"][numbers.isna()])
    assert unknown
    for state, ascending in (("ascending", True), ("descending", False)):
        head.get_by_role("button").press("Enter")
        order = numbers[known.index].sort_values(ascending=ascending, kind="stable").index
        assert head.get_attribute("aria-sort") == state
        assert watched.shown() == list(ledger["id"][order]) + unknown
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") is None
    assert watched.shown() == list(ledger["id"])
    by_verdict = watched.page.locator("#claims thead th.verdict button")
    by_verdict.click()
    verdicts = ledger.set_index("id")["verdict"][watched.shown()]
    assert list(verdicts) == sorted(verdicts)
    # sorting keeps the filter
    watched.page.locator("select[name=kind]").select_option("input")
    assert sorted(watched.shown()) == sorted(ledger["id"][ledger["kind"] == "input"])
    by_verdict.click(click_count=2)


def test_every_table_is_saved_as_it_was(watched: Watched, build: Path, tmp_path: Path) -> None:
    links = watched.page.locator("a.file")
    assert links.count() == 5  # the ledger, and two figures of the same two tables
    links.and_(watched.page.locator("[href]")).nth(4).wait_for()  # they are unpacked by now
    for link in links.all():
        with watched.page.expect_download() as waiting:
            link.click()
        name = waiting.value.suggested_filename
        waiting.value.save_as(tmp_path / name)
        original = build / name if name == "claims.csv" else build / "results" / name
        assert (tmp_path / name).read_bytes() == original.read_bytes()
    assert (tmp_path / "f_gamma_summary.csv").read_bytes().startswith(BREAKING_OUT.encode())


def test_a_picture_can_be_enlarged(phone: Watched) -> None:
    button = phone.page.locator("#fig_2_10 .picture button")
    before = button.bounding_box()
    button.tap()
    after = button.bounding_box()
    assert before
    assert after
    assert after["width"] > 1.4 * before["width"]
    assert button.get_attribute("aria-pressed") == "true"
    assert phone.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_phone_shows_all_without_scrolling_sideways(phone: Watched, ledger: pd.DataFrame) -> None:
    assert phone.page.evaluate("innerWidth") == PHONE["width"]
    assert phone.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    script = """() => [...document.querySelectorAll("body *")].filter((element) => element.checkVisibility()
            && element.getBoundingClientRect().right > innerWidth + 0.5
            && !element.parentElement.closest(".box, pre, .picture, code")).map((element) => element.outerHTML)"""
    assert phone.page.evaluate(script) == []
    boxes = """() => [...document.querySelectorAll("table")].map((table) => table.closest(".box")).map((box) =>
        [box.getBoundingClientRect().right <= innerWidth, box.scrollWidth, box.clientWidth,
         getComputedStyle(box).overflowX])"""
    differing = list(ledger["id"][ledger["verdict"] == "differs"])
    assert phone.shown() == differing
    height = phone.page.evaluate("document.documentElement.scrollHeight")
    phone.show_all()
    assert phone.shown() == list(ledger["id"])
    assert phone.page.evaluate("document.documentElement.scrollHeight") - height < 200 * (len(ledger) - len(differing))
    for inside, scroll, client, overflow in phone.page.evaluate(boxes):
        assert inside
        assert scroll <= client or overflow == "auto"


def test_letters_are_large_enough_on_a_phone(phone: Watched) -> None:
    script = """() => {
        const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        const sizes = [];
        for (let node = walker.nextNode(); node; node = walker.nextNode()) {
            const element = node.parentElement;
            const small = Number(getComputedStyle(element).mathDepth) > 0;  // an index or an exponent
            if (node.data.trim() && element.checkVisibility() && !small)
                sizes.push([parseFloat(getComputedStyle(element).fontSize) * visualViewport.scale, node.data.trim()]);
        }
        return sizes; }"""
    sizes = phone.page.evaluate(script)
    assert len(sizes) > 1000
    assert not [pair for pair in sizes if pair[0] < SMALLEST]


def test_without_scripts_all_rows_are_there(browser: Browser, address: str, ledger: pd.DataFrame) -> None:
    watched = Watched(browser, address, java_script_enabled=False)
    rows = watched.page.locator("#claims tbody tr")
    assert rows.count() == len(ledger)
    assert rows.last.is_visible()
    watched.counts(f"{len(ledger)} of {len(ledger)} rows")
    assert not watched.page.locator("#filter").is_visible()
    assert watched.page.get_by_text("needs JavaScript to show them").is_visible()
    watched.context.close()


def test_runs_over_time_are_zoomed_by_keys_and_buttons(watched: Watched) -> None:
    page, rows = watched.page, "".join(f"{0.01 * k:.2f},{k},{-k}\n" for k in range(1001))
    page.evaluate(
        """async (text) => {
            tables.set("made", new TextEncoder().encode(text).buffer);
            const part = document.createElement("details");
            [part.className, part.open, part.dataset.table] = ["zoom", true, "made"];
            document.getElementById("figures").append(part);
            await zoomable(part);
        }""",
        f"# a remark\ntime_s,reference,output_none\n{rows}",
    )
    canvas, said = page.get_by_label("made: output"), page.locator(".zoom output")
    canvas.press("+")
    expect(said).to_have_text("2.5 s to 7.5 s")
    canvas.press("ArrowRight")
    expect(said).to_have_text("3 s to 8 s")
    canvas.press("0")
    expect(said).to_have_text("0 s to 10 s")
    canvas.hover(position={"x": 100, "y": 50})
    page.mouse.wheel(0, -100)
    expect(said).to_contain_text("reference")
    page.mouse.move(0, 0)
    page.get_by_role("button", name="Zoom in").click()
    page.get_by_role("button", name="Whole run").click()
    expect(said).to_have_text("0 s to 10 s")
    assert page.get_by_role("checkbox", name="none").is_checked()


def test_fields_and_count_are_named_for_those_who_cannot_see(watched: Watched) -> None:
    for name in ("Verdict", "Kind", "Chapter"):
        assert watched.page.get_by_role("combobox", name=name).count() == 1
    assert watched.page.get_by_role("searchbox", name="Search").count() == 1
    assert watched.page.get_by_role("table").count() >= 2
    assert watched.page.locator("#count").get_attribute("aria-live") == "polite"
    assert watched.page.get_by_role("columnheader", name="verdict").count() == 1
    assert not watched.violations()


def test_a_phone_is_as_accessible_and_its_contents_are_a_menu(phone: Watched) -> None:
    menu = phone.page.get_by_role("navigation", name="Contents")
    link = menu.get_by_role("link", name="The ledger")
    assert not link.is_visible()
    menu.get_by_text("Contents", exact=True).tap()
    assert not phone.violations()
    link.tap()
    assert not link.is_visible()
    assert phone.page.evaluate("Math.abs(document.getElementById('ledger').getBoundingClientRect().top) < 100")


def test_on_paper_every_row_is_there_and_nothing_is_folded(watched: Watched, ledger: pd.DataFrame) -> None:
    watched.page.locator("select[name=verdict]").select_option("differs")
    watched.page.emulate_media(media="print")
    watched.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert sorted(watched.shown()) == sorted(ledger["id"])
    assert watched.page.locator("main details:not([open]):not(.zoom)").count() == 0
    assert not watched.page.get_by_role("navigation").is_visible()
    watched.page.evaluate("dispatchEvent(new Event('afterprint'))")
    watched.page.emulate_media(media="screen")
