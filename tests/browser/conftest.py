"""What the browser tests share: a headless Chromium, the program, and pages made by it.

    CIRC=target/debug/circ CHROMIUM=/usr/bin/chromium python3 -m pytest tests/browser
"""

import csv
import os
import pathlib
import subprocess

import pytest
from playwright.sync_api import sync_playwright

ROOT = pathlib.Path(__file__).resolve().parents[2]
CIRC = pathlib.Path(os.environ.get("CIRC", ROOT / "target/debug/circ"))


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"), args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def show(browser):
    """Opens a file as a page; the test fails where the console says anything."""
    said, pages = [], []

    def opened(path, waits=True, **options):
        page = browser.new_page(viewport={"width": 1200, "height": 900}, **options)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: None if request.url.startswith(("file:", "data:", "blob:", "http://127.0.0.1")) else said.append(request.url))
        page.goto(pathlib.Path(path).as_uri() if "://" not in str(path) else str(path))
        if waits:
            page.wait_for_function("window.circ !== undefined")
        pages.append(page)
        return page

    yield opened
    for page in pages:
        page.close()
    assert said == []


def run(*arguments, **options):
    """The program, which must succeed."""
    done = subprocess.run([CIRC, *map(str, arguments)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr
    return done


def page_of(folder, netlist):
    """The page that the program makes of a netlist."""
    (folder / "a.cir").write_text(netlist)
    run("sim", folder / "a.cir", "-q", "-o", folder / "a.html")
    return folder / "a.html"


def rows(path):
    """A CSV file by column."""
    with open(path, newline="") as file:
        table = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in table] for name in table[0]}
