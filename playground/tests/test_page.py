"""The built playground in headless Chromium: `pytest playground/tests` after `playground/build.sh` (needs playwright and Debian's chromium)."""

import functools
import gzip
import http.server
import pathlib
import shutil
import threading

import pytest
from playwright.sync_api import expect, sync_playwright

DIST = pathlib.Path(__file__).parent.parent / "dist"
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"]
# ms; runs of the examples take a tenth of it.
PATIENCE = 30_000
RC = "charging\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u ic=0\n.tran 10u 5m uic\n.end\n"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def address():
    handler = functools.partial(Quiet, directory=DIST)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/"
        server.shutdown()


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as play:
        yield play.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)


@pytest.fixture
def page(browser, address):
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(address)
    expect(page.locator("#state")).to_have_text("done", timeout=PATIENCE)
    yield page
    page.close()
    assert faults == []


def test_an_example_is_drawn_and_run(page):
    assert page.locator(".circuit svg").count() == 1
    assert page.locator(".circuit").inner_text().split().count("rload") == 1
    # Volts, the gate and amperes.
    assert page.locator("#right .uplot").count() == 3
    assert "exact" in page.locator("#right pre").first.inner_text()
    page.select_option("#examples", "boost")
    expect(page.locator(".circuit")).to_contain_text("Boost converter", timeout=PATIENCE)


def test_what_is_wrong_is_underlined_where_it_stands(page):
    page.fill("#text", RC.replace("1k", "1q2"))
    expect(page.locator("#state")).to_have_text("refused", timeout=PATIENCE)
    mark = page.locator("#marks .error")
    assert "1q2" in mark.first.inner_text()
    assert page.locator("#findings li.error").first.inner_text().startswith("3: ")
    # The mark is under the letters that it is about.
    place = mark.first.bounding_box()
    editor = page.locator("#text").bounding_box()
    line = 13 * 1.5
    assert abs(place["y"] - (editor["y"] + 0.8 * 13 + 2 * line)) < line / 2
    page.fill("#text", RC)
    expect(page.locator("#state")).to_have_text("done", timeout=PATIENCE)
    assert page.locator("#findings li").count() == 0


def test_the_address_holds_the_circuit(page, browser):
    page.fill("#text", RC.replace("charging", "µ and 電"))
    expect(page.locator(".circuit")).to_contain_text("µ and 電", timeout=PATIENCE)
    other = browser.new_page()
    other.goto(page.url)
    expect(other.locator("#state")).to_have_text("done", timeout=PATIENCE)
    assert other.input_value("#text") == page.input_value("#text")
    other.close()


def test_a_run_without_end_is_stopped_by_the_next_keystroke(page):
    page.fill("#text", RC.replace("10u 5m", "1n 100"))
    page.wait_for_timeout(1000)
    page.fill("#text", RC)
    expect(page.locator("#state")).to_have_text("done", timeout=PATIENCE)
    expect(page.locator(".circuit")).to_contain_text("charging")


def test_what_a_reader_looks_at_stays_when_the_netlist_changes(page):
    page.fill("#text", RC)
    expect(page.locator(".circuit")).to_contain_text("charging", timeout=PATIENCE)
    expect(page.locator("#state")).to_have_text("done", timeout=PATIENCE)
    page.locator(".panel").first.focus()
    page.keyboard.press("+")
    page.keyboard.press("a")
    seen = page.evaluate("[window.circ.state.view, window.circ.state.cursors.a]")
    page.fill("#text", RC.replace("r1 in out 1k", "r1 in out 2k"))
    expect(page.locator(".circuit")).to_contain_text("2k", timeout=PATIENCE)
    page.wait_for_function("boundsIn(window.circ.panels[0].curves[1], 0, 1)[1] < 0.95")
    assert page.evaluate("[window.circ.state.view, window.circ.state.cursors.a]") == seen


def test_a_netlist_is_text_not_markup(page):
    page.fill("#text", RC.replace("charging", "<img src=x onerror=document.title='taken'>"))
    expect(page.locator(".circuit")).to_contain_text("<img", timeout=PATIENCE)
    assert page.title() == "circ playground"


def test_all_of_it_is_small():
    size = sum(len(gzip.compress(file.read_bytes())) for file in DIST.rglob("*") if file.is_file())
    assert size <= 1_500_000
