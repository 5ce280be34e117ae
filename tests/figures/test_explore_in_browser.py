"""The page to play on in a real browser, at the width of a desk and of a phone; and whom its server lets in."""

from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from design.design_file import Design, read_design
from identification.model.signals import Signals

ROOT = Path(__file__).resolve().parents[2]
SIZES = {"desk": {"width": 1280, "height": 900}, "phone": {"width": 390, "height": 844}}
SMALLEST = 12  # of letters [px]
expect.set_options(timeout=30_000)  # where many tests run at once
SETTLED = "() => window.Bokeh?.documents[0]?.get_model_by_name('run')?.data.time_s.length > 0"
DATA = "(name) => Array.from(Bokeh.documents[0].get_model_by_name('run').data[name])"
STATE = "() => Bokeh.documents[0].get_model_by_name('sliders').tags[0]"
# From the first event of a drag to the frame after the data that it asked for, in ms; drags meanwhile are not counted.
WATCH = """() => {
  window.waits = []
  let began = null
  for (const kind of ["pointermove", "keydown"])
    addEventListener(kind, (event) => { if (event.buttons || kind == "keydown") began ??= performance.now() }, true)
  Bokeh.documents[0].get_model_by_name("run").properties.data.change.connect(() => {
    if (began === null) return
    const start = began
    began = null
    requestAnimationFrame(() => setTimeout(() => window.waits.push(performance.now() - start)))
  })
}"""


class Served(NamedTuple):
    """A page that is served, and the design behind it."""

    address: str
    folder: Path
    design: Design

    @property
    def port(self) -> int:
        port = urlsplit(self.address).port
        assert port is not None
        return port


@pytest.fixture(scope="module")
def served(extended_design: Design, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("explore")
    design = Design(**vars(extended_design) | {"signals": Signals("motor current", "A", "<b>elevation</b>", "deg")})
    (folder / "design.json").write_text(design.to_json(), encoding="utf-8")
    (folder / "axis.toml").write_text("limit = 12\namplitude = 50\nphase = 1.5\n", encoding="utf-8")
    words = ["antiwindup", "explore", "design.json", "--no-browser", "--axis", "axis.toml"]
    process = subprocess.Popen(
        [sys.executable, "-m", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "BOKEH_RESOURCES": "cdn"},
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    address = process.stderr.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address), address + process.stderr.read()
    yield Served(address, folder, design)
    process.send_signal(signal.SIGINT)
    assert process.wait(10) == 130
    said = process.stderr.read()
    process.stderr.close()
    assert said == "Interrupted; no file is half written.\n"


def asked(served: Served, path: str, **headers: str) -> int:
    """The status of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=10)
    connection.request("GET", path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


def test_every_request_needs_the_token_the_host_and_the_origin(served: Served) -> None:
    own, place = urlsplit(served.address).path, f"127.0.0.1:{served.port}"
    socket_asked = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Protocol": "bokeh, token",
    }
    script = "static/js/bokeh.min.js"
    assert [asked(served, own), asked(served, own + script)] == [200, 200]
    assert asked(served, f"{own}ws") == 400  # a websocket's, and no request for one
    wrong = [own[:-2] + "A/", "/", "/" + own[2:], f"/{'A' * 32}/", own[1:-1].lower().join("//"), "/%ff/", "//"]
    for start in {each for each in wrong if each != own}:
        assert [asked(served, start + rest) for rest in ("", script, "ws", "favicon.ico")] == [403] * 4, start
        assert asked(served, f"{start}ws", **socket_asked) == 403
    for headers in (
        {"Host": "localhost.example"},
        {"Host": f"localhost.example:{served.port}"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://example.org"},
        {"Origin": "null"},
        {"Origin": f"http://127.0.0.1:{served.port + 1}"},
        {"Origin": f"https://{place}"},
    ):
        assert [asked(served, own, **headers), asked(served, own + script, **headers)] == [403, 403], headers
        assert asked(served, f"{own}ws", **socket_asked | headers) == 403, headers
    assert asked(served, own, Origin=f"http://{place}") == 200


def test_it_listens_to_this_machine_alone(served: Served) -> None:
    """Another address of the same machine, which a server of all addresses would answer at."""
    with socket.create_connection(("127.0.0.1", served.port), timeout=5):
        pass
    with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.2", served.port), timeout=5):
        pass


class Visit:
    """A page in the browser, and what that complained of."""

    def __init__(self, browser: Browser, address: str, size: str) -> None:
        self.size = size
        self.context = browser.new_context(viewport=SIZES[size], is_mobile=size == "phone")
        self.page: Page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", self._heard)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("requestfailed", lambda request: self.complaints.append(f"failed: {request.url}"))
        self.page.goto(address)
        self.page.wait_for_function(SETTLED)

    def _heard(self, message: Any) -> None:
        if message.type not in ("log", "info", "debug"):
            self.complaints.append(message.text)

    def handle(self, name: str, number: int = 0) -> Any:
        """The handle of a slider, which takes the keys of the arrows."""
        place = "(name) => Bokeh.documents[0].get_model_by_name('sliders').children.findIndex((e) => e.name == name)"
        index = self.page.evaluate(place, name)
        assert index >= 0
        sliders = self.page.locator("#sliders .noUi-target")
        return sliders.nth(index).locator(".noUi-handle").nth(number)

    def pressed(self, name: str, *keys: str, number: int = 0) -> str:
        """The page's state after keys on a slider, once the address has it."""
        before = self.page.evaluate(STATE)
        self.handle(name, number).focus()
        for key in keys:
            self.page.keyboard.press(key)
        self.page.wait_for_function(f"(before) => ({STATE})() != before", arg=before)
        self.page.wait_for_function(f"() => location.search == '?' + ({STATE})()")
        return str(self.page.evaluate(STATE))


@pytest.fixture(params=SIZES)
def visit(request: pytest.FixtureRequest, browser: Browser, served: Served) -> Iterator[Visit]:
    visit = Visit(browser, served.address, request.param)
    yield visit
    visit.context.close()
    assert not visit.complaints


def answers_in_every_way(visit: Visit, served: Served, upper: float) -> None:
    """What a page does that is the same at every width."""
    page = visit.page

    # the keys reach every slider; the plant's own changes redraw the curves, and the page says which plant it is
    curve = "() => Array.from(Bokeh.documents[0].get_model_by_name('true').data.real).filter(isFinite)"
    own = page.evaluate(curve)
    visit.pressed("gain-0", "PageUp")
    expect(page.locator("#said").get_by_text("the design's model with its gain times")).to_be_visible()
    assert page.evaluate(curve) != own
    state = visit.pressed("dead-time-0", "End")
    expect(page.locator("#said").get_by_text("The loop without limits is UNSTABLE: 2 roots")).to_be_visible()
    expect(page.locator("#audit").get_by_text("No guarantee: the true plant is not within W_a")).to_be_visible()

    # the address opens the same page
    run = page.evaluate(DATA, "output")
    page.reload()
    page.wait_for_function(SETTLED)
    assert page.evaluate(STATE) == state
    assert page.evaluate(DATA, "output") == run
    expect(page.locator("#sliders").get_by_text(f"limits of motor current [A]: -12 .. {upper:g}")).to_be_visible()

    # what is refused is said, and the page goes on
    page.locator("select").select_option("robust")
    said = page.locator("#said").get_by_text("Refused, so that the pictures are those before: ")
    expect(said).to_be_visible()
    page.locator("select").select_option("sector")
    expect(said).not_to_be_visible()

    # save writes the design that is shown
    saved = served.folder / "design_explored.json"
    saved.unlink(missing_ok=True)
    visit.pressed("recovery-0", "ArrowLeft")
    page.get_by_role("button", name="save as design_explored.json").click()
    expect(page.get_by_text("Saved: design_explored.json")).to_be_visible()
    found = read_design(saved)
    assert found.corrected.guarantee == "sector"
    assert found.signals == served.design.signals
    assert found.compared
    assert read_design(served.folder / "design.json") == served.design


def test_a_visit(visit: Visit, served: Served) -> None:
    """Everything in one: a page takes seconds to load where many tests run at once."""
    page = visit.page
    page.wait_for_function("() => document.body.innerText.length > 0")
    assert all(url.startswith((served.address, "data:")) for url in visit.requests)  # so no network is needed

    # names and units are those of the design, and a name is text
    labels = page.evaluate(
        "() => ['output', 'control'].map((n) => Bokeh.documents[0].get_model_by_name(n).left[0].axis_label)"
    )
    assert labels == ["<b>elevation</b> [deg]", "motor current [A]"]
    expect(page.locator("#sliders").get_by_text("limits of motor current [A]: -12 .. 12")).to_be_visible()
    expect(page.locator("#said").get_by_text("True plant: the design's own model.")).to_be_visible()

    # a drag of a limit changes the run and the address, and the browser is asked how long that took
    before = page.evaluate(DATA, "saturated_control")
    assert max(before) == pytest.approx(12.0)
    page.evaluate(WATCH)
    box = visit.handle("limit", 1).bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(x - 2 * step, y)
        page.wait_for_timeout(30)
    page.mouse.up()
    page.wait_for_function(f"() => location.search == '?' + ({STATE})() && location.search")
    upper = float(parse_qs(urlsplit(page.url).query)["limit"][1])
    assert 4 < upper < 11
    page.wait_for_function(
        "(upper) => Math.max(...Bokeh.documents[0].get_model_by_name('run').data.saturated_control) == upper", arg=upper
    )
    waits = sorted(page.evaluate("window.waits"))
    print(f"drag to picture: {len(waits)} pictures, median {waits[len(waits) // 2]:.0f} ms, least {waits[0]:.0f} ms")

    if visit.size == "desk":
        answers_in_every_way(visit, served, upper)

    # nothing sticks out, and letters can be read
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    sizes = page.evaluate(
        """() => [...document.querySelectorAll("section *")].flatMap((element) => [element,
            ...(element.shadowRoot?.querySelectorAll("*") ?? [])]).filter((element) => element.checkVisibility()
            && [...element.childNodes].some((node) => node.nodeType == 3 && node.data.trim())
            && element.tagName != "STYLE").map((element) => parseFloat(getComputedStyle(element).fontSize))"""
    )
    assert min(sizes) >= SMALLEST


def test_an_address_that_asks_for_what_is_not_there_is_told_so(browser: Browser, served: Served) -> None:
    visit = Visit(browser, f"{served.address}?a=-1", "desk")
    expect(visit.page.locator("#said").get_by_text("a is -1; expected a positive number.")).to_be_visible()
    visit.pressed("amplitude-0", "ArrowRight")
    expect(visit.page.locator("#said").get_by_text("a is -1")).not_to_be_visible()
    visit.context.close()
    assert not visit.complaints
