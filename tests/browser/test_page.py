"""The page of a result: what it shows is what was computed, and its controls do what they say."""

import math
import re
import subprocess

import pytest
from conftest import CIRC, ROOT, page_of, rows, run

SINE = "a sine\nv1 in 0 sin(0 3 1k)\nr1 in out 1k\nc1 out 0 1n\n.tran 1u 10m\n.meas tran top max v(in)\n.end\n"
BUCK = ROOT / "netlists/buck.cir"


@pytest.fixture(scope="module")
def buck(tmp_path_factory):
    folder = tmp_path_factory.mktemp("buck")
    run("sim", BUCK, "-o", folder / "out.html", "-o", folder / "out.csv", "--events")
    return folder


def view(page):
    return page.evaluate("window.circ.state.view")


def reading(page, row, at):
    """The number behind a cell of the table of readings."""
    return cell(page, row, at).get_attribute("data-value")


def cell(page, row, at):
    return page.locator(f".readings tr[data-signal='{row}'] [data-at={at}]")


def cursor(page, at):
    return page.locator(f".readings thead [data-at={at}]").get_attribute("data-value")


def first(page):
    """The first panel, in focus."""
    panel = page.locator(".panel").first
    panel.focus()
    return panel


def middle(page, part=0.5):
    """A point on the first panel's plot."""
    box = page.locator(".panel .u-over").first.bounding_box()
    return box["x"] + part * box["width"], box["y"] + 0.5 * box["height"]


def test_it_shows_panels_events_and_words(buck, show):
    page = show(buck / "out.html")
    assert page.title() == "Buck converter, 12 V to 5 V, 50 kHz"
    names = page.evaluate("window.circ.panels.map((p) => [p.unit, p.curves.map((c) => c.name)])")
    assert names == [["V", ["v(out)"]], ["V", ["v(sw)"]], ["A", ["i(l1)"]]]
    assert page.evaluate("window.circ.strips.map((s) => s.name)") == ["s1", "d1"]
    page.get_by_text("Events (").click()
    assert page.get_by_role("cell", name="s1 on").first.is_visible()
    assert "exact:" in page.locator("pre").first.inner_text()
    # Curves are drawn: the canvas is not blank.
    colours = "(c) => new Set(new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size"
    assert page.locator(".panel canvas").first.evaluate(colours) > 2


def test_what_a_cursor_reads_is_what_was_computed(buck, show):
    table = rows(buck / "out.csv")
    page = show(buck / "out.html")
    first(page)
    page.keyboard.press("a")
    exact = 0
    for _ in range(20):
        page.keyboard.press(".")
        t = float(cursor(page, "a"))
        at = [k for k, time in enumerate(table["time"]) if time == t]
        if at:
            exact += 1
            for name in ("v(out)", "v(sw)", "i(l1)"):
                assert float(reading(page, name, "a")) == table[name][at[-1]]
    assert exact >= 15
    assert "Cursor A at" in page.locator("output[aria-live]").inner_text()


def test_two_cursors_and_their_difference(buck, show):
    page = show(buck / "out.html")
    page.mouse.click(*middle(page, 0.25))
    page.keyboard.down("Shift")
    page.mouse.click(*middle(page, 0.75))
    page.keyboard.up("Shift")
    a, b = float(cursor(page, "a")), float(cursor(page, "b"))
    assert abs(a - 0.5e-3) < 2e-5 and abs(b - 1.5e-3) < 2e-5
    assert float(cursor(page, "delta")) == b - a
    assert "Hz" in page.locator(".readings thead [data-at=delta]").inner_text()
    assert float(reading(page, "i(l1)", "delta")) == float(reading(page, "i(l1)", "b")) - float(reading(page, "i(l1)", "a"))
    state = cell(page, "d1", "a").inner_text()
    assert state in ("conducts", "blocks")


def test_mean_and_rms_between_two_cursors(buck, show):
    table = rows(buck / "out.csv")
    page = show(buck / "out.html")
    assert cell(page, "i(l1)", "mean").inner_text() == ""
    # The earlier one may be either; both stand on rows, some at jumps of the switch node.
    for first_at, second_at in ((0.75, 0.2), (0.2, 0.7)):
        page.mouse.click(*middle(page, first_at))
        page.keyboard.down("Shift")
        page.mouse.click(*middle(page, second_at))
        page.keyboard.up("Shift")
        a, b = sorted(float(cursor(page, at)) for at in "ab")
        for name in ("v(sw)", "i(l1)"):
            inside = [k for k, t in enumerate(table["time"]) if a <= t <= b]
            # The last row at a and the first at b.
            start = max(k for k in inside if table["time"][k] == a)
            end = min(k for k in inside if table["time"][k] == b)
            mean = square = 0.0
            for k in range(start, end):
                dt, y, z = table["time"][k + 1] - table["time"][k], table[name][k], table[name][k + 1]
                mean += dt * (y + z) / 2 / (b - a)
                square += dt * (y * y + y * z + z * z) / 3 / (b - a)
            assert float(reading(page, name, "mean")) == pytest.approx(mean, rel=1e-9)
            assert float(reading(page, name, "rms")) == pytest.approx(math.sqrt(square), rel=1e-9)
    page.keyboard.press("Escape")
    assert cell(page, "i(l1)", "rms").inner_text() == ""


def test_states_between_events(buck, show):
    page = show(buck / "out.html")
    table = rows(buck / "out.csv")
    # At the middle of an on-time the switch node is at 12 V, and the switch is on.
    first(page)
    for part in (0.13, 0.31, 0.47, 0.62, 0.88):
        page.mouse.click(*middle(page, part))
        t = float(cursor(page, "a"))
        words = cell(page, "s1", "a").inner_text()
        value = float(reading(page, "v(sw)", "a"))
        assert (words == "on") == (value > 11), (t, words, value)
    assert max(table["v(sw)"]) > 11


def test_zoom_and_pan(buck, show):
    page = show(buck / "out.html")
    assert view(page) == [0, 2e-3]
    panel = first(page)
    page.keyboard.press("+")
    assert view(page) == pytest.approx([0.5e-3, 1.5e-3])
    page.keyboard.press("ArrowRight")
    assert view(page) == pytest.approx([0.7e-3, 1.7e-3])
    page.keyboard.press("Home")
    assert view(page) == [0, 2e-3]
    page.mouse.move(*middle(page))
    page.mouse.wheel(0, -100)
    page.wait_for_function("window.circ.state.view[1] < 2e-3")
    assert view(page) == pytest.approx([0.2e-3, 1.8e-3], rel=0.02)
    # To a span by dragging, and back.
    start, end = middle(page, 0.25), middle(page, 0.5)
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=5)
    page.mouse.up()
    assert view(page) == pytest.approx([0.6e-3, 1e-3], rel=0.02)
    page.mouse.dblclick(*middle(page))
    assert view(page) == [0, 2e-3]
    assert panel.evaluate("(p) => p === document.activeElement")


def drag(page, start, end):
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=5)
    page.mouse.up()


def bounds(page, panel):
    return page.evaluate(f"window.circ.boundsOf(window.circ.panels[{panel}])")


def test_a_box_zooms_both_ways_and_a_height_one(buck, show):
    page = show(buck / "out.html")
    whole = [bounds(page, k) for k in range(3)]
    box = page.locator(".panel .u-over").first.bounding_box()
    at = lambda x, y: (box["x"] + x * box["width"], box["y"] + y * box["height"])
    inner = lambda low, high: [whole[0][0] + part * (whole[0][1] - whole[0][0]) for part in (low, high)]
    drag(page, at(0.2, 0.1), at(0.6, 0.6))
    assert view(page) == pytest.approx([0.4e-3, 1.2e-3], rel=0.02)
    assert bounds(page, 0) == pytest.approx(inner(0.4, 0.9), rel=0.03)
    page.keyboard.press("Home")
    assert view(page) == [0, 2e-3] and [bounds(page, k) for k in range(3)] == whole
    # Upright: the span stays, and so do other panels.
    drag(page, at(0.5, 0.25), at(0.503, 0.75))
    assert view(page) == [0, 2e-3]
    assert bounds(page, 0) == pytest.approx(inner(0.25, 0.75), rel=0.03)
    assert [bounds(page, k) for k in (1, 2)] == whole[1:]
    page.mouse.dblclick(*middle(page))
    assert bounds(page, 0) == whole[0]


def test_runs_of_steps_are_shown_and_hidden_at_once(tmp_path, show):
    netlist = tmp_path / "steps.cir"
    netlist.write_text("steps\n.param r=1k\nv1 a 0 sin(0 1 1k)\nr1 a b {r}\nc1 b 0 1u\n.step param r list 1k 2k 3k\n.tran 10u 2m\n.end\n")
    run("sim", netlist, "-o", tmp_path / "steps.html")
    page = show(tmp_path / "steps.html")
    shown = "[...new Set(window.circ.panels.flatMap((p) => p.curves).filter((c) => c.shown).map((c) => c.run))]"
    assert page.evaluate(shown) == ["r=1000", "r=2000", "r=3000"]
    page.get_by_label("r=2000", exact=True).uncheck()
    assert page.evaluate(shown) == ["r=1000", "r=3000"]
    page.get_by_label("r=2000", exact=True).check()
    assert len(page.evaluate(shown)) == 3


def test_a_toggle_takes_a_curve_out_of_its_panel(tmp_path, show):
    netlist = tmp_path / "two.cir"
    netlist.write_text("two\nv1 a 0 sin(0 100 1k)\nr1 a b 1k\nr2 b 0 25\n.tran 10u 2m\n.end\n")
    run("sim", netlist, "-o", tmp_path / "two.html")
    page = show(tmp_path / "two.html")
    highest = "window.circ.state.plots[0].scales.y.max"
    assert page.evaluate(highest) > 100
    page.get_by_role("checkbox", name="v(a)").uncheck()
    assert 2.4 < page.evaluate(highest) < 3
    page.get_by_role("checkbox", name="v(a)").check()
    assert page.evaluate(highest) > 100


def test_dark_and_light(buck, show):
    paper = "getComputedStyle(document.body).backgroundColor"
    page = show(buck / "out.html")
    light = page.evaluate(paper)
    page.get_by_role("button", name="dark / light").click()
    dark = page.evaluate(paper)
    assert light == "rgb(255, 255, 255)" and dark != light
    page.get_by_role("button", name="dark / light").click()
    assert page.evaluate(paper) == light
    assert show(buck / "out.html", color_scheme="dark").evaluate(paper) == dark


def test_the_spectrum_of_a_sine(tmp_path, show):
    netlist = tmp_path / "sine.cir"
    netlist.write_text(SINE)
    run("sim", netlist, "-o", tmp_path / "sine.html")
    page = show(tmp_path / "sine.html")
    assert "top" in page.locator("pre").first.inner_text()
    page.get_by_role("button", name="spectrum").click()
    section = page.get_by_role("region", name="spectrum")
    assert section.is_visible()
    peak = page.evaluate(
        "(() => { const c = spectrumOf(window.circ.panels[0].curves.find((c) => c.name === 'v(in)'), 0, 10e-3);"
        "const k = c.y.indexOf(Math.max(...c.y)); return [c.x[k], c.y[k]]; })()"
    )
    assert peak == pytest.approx([1000, 3], rel=1e-3)
    page.get_by_role("button", name="spectrum").click()
    assert not section.is_visible()


def test_logarithmic_values(tmp_path, show):
    netlist = tmp_path / "decay.cir"
    netlist.write_text("decay\nc1 out 0 1u ic=1\nr1 out 0 1k\n.tran 10u 5m uic\n.end\n")
    run("sim", netlist, "-o", tmp_path / "decay.html")
    page = show(tmp_path / "decay.html")
    page.get_by_role("button", name="log y").click()
    assert page.evaluate("window.circ.state.plots[0].scales.y.distr") == 3
    low, high = page.evaluate("[window.circ.state.plots[0].scales.y.min, window.circ.state.plots[0].scales.y.max]")
    assert 0 < low < math.exp(-5) and high >= 1


def test_a_jump_is_read_after_it(tmp_path, show):
    netlist = tmp_path / "jump.cir"
    netlist.write_text("jump\nv1 a 0 pulse(0 5 1m 0 0 1 2)\nr1 a b 1k\nr2 b 0 1k\n.tran 0.5m 2m\n.end\n")
    run("sim", netlist, "-o", tmp_path / "jump.html")
    page = show(tmp_path / "jump.html")
    rows_of_jump = page.evaluate("(() => { const c = window.circ.panels[0].curves[0]; return Array.from(c.x).map((t, k) => [t, c.y[k]]).filter(([t]) => t === 1e-3); })()")
    assert rows_of_jump == [[1e-3, 0], [1e-3, 5]]
    first(page)
    page.keyboard.press("a")
    assert (float(cursor(page, "a")), float(reading(page, "v(a)", "a"))) == (1e-3, 5)


def test_a_bode_page(tmp_path, show):
    netlist = tmp_path / "filter.cir"
    netlist.write_text("filter\nv1 in 0 dc 0 ac 1\nr1 in out 1k\nc1 out 0 159.15494309189535n\n.ac dec 10 10 100k\n.end\n")
    run("ac", netlist, "-o", tmp_path / "filter.html", "--probe", "v(out)")
    page = show(tmp_path / "filter.html")
    assert page.evaluate("window.circ.panels.map((p) => [p.quantity, p.unit])") == [["gain", "dB"], ["phase", "°"]]
    first(page)
    page.keyboard.press("a")
    # In the middle, at 1 kHz, is the corner.
    assert float(cursor(page, "a")) == pytest.approx(1e3)
    gain = page.evaluate("window.circ.panels.map((p) => valueAt(p.curves[0], window.circ.state.cursors.a))")
    assert gain == pytest.approx([-10 * math.log10(2), -45], abs=1e-9)


def test_a_logarithmic_axis_shows_what_is_asked_for(tmp_path, show):
    netlist = tmp_path / "filter.cir"
    netlist.write_text("filter\nv1 in 0 dc 0 ac 1\nr1 in out 1k\nc1 out 0 100n\n.ac dec 20 30 70k\n.end\n")
    run("ac", netlist, "-o", tmp_path / "filter.html", "--probe", "v(out)")
    page = show(tmp_path / "filter.html")
    scale = "[window.circ.state.plots[0].scales.x.min, window.circ.state.plots[0].scales.x.max]"
    labels = "window.circ.state.plots[0].axes[0]._values.filter((label) => label)"
    # Points of 20 a decade from 30 Hz on; the last is the one before 70 kHz.
    assert page.evaluate(scale) == view(page) and view(page)[0] == pytest.approx(30, rel=1e-12) and 60e3 < view(page)[1] <= 70e3
    assert {"100 Hz", "1 kHz", "10 kHz"} <= set(page.evaluate(labels))
    first(page)
    for _ in range(4):
        page.keyboard.press("+")
        assert page.evaluate(scale) == view(page)
    low, high = view(page)
    assert high / low < 2 and len(page.evaluate(labels)) >= 2
    page.keyboard.press("Home")
    page.get_by_role("button", name="log x").click()
    assert page.evaluate("window.circ.state.plots[0].scales.x.distr") == 1
    page.get_by_role("button", name="log x").click()
    assert page.evaluate(scale) == view(page)


@pytest.mark.parametrize("netlist", sorted((ROOT / "netlists/small-signal").glob("*.cir")), ids=lambda path: path.stem)
def test_signals_without_a_response_leave_room_for_others(netlist, tmp_path, show):
    run("ac" if re.search(r"^\.ac", netlist.read_text(), re.MULTILINE) else "sim", netlist, "-o", tmp_path / "a.html")
    page = show(tmp_path / "a.html")
    rows_of = page.evaluate("window.circ.panels.map((p) => p.curves.map((c) => c.y.length))")
    drawn = page.evaluate("window.circ.state.plots.map((plot) => plot.axes.every((axis) => axis._values.length > 1))")
    assert all(any(panel) for panel in rows_of) and drawn == [True] * len(rows_of)
    assert "NaN" not in saved(page)
    # Cursors stand on rows of a signal that has some.
    first(page)
    page.keyboard.press("a")
    assert view(page)[0] <= float(cursor(page, "a")) <= view(page)[1]


@pytest.mark.parametrize("lines", ["", "0,0\n", "0,0\n0,0\n0,0\n", "0,0\n1,0\n2,0\n"])
def test_files_of_no_rows_or_of_zeros_have_pages(lines, tmp_path, show):
    (tmp_path / "a.csv").write_text("time,v(a)\n" + lines)
    run("view", tmp_path / "a.csv", "-o", tmp_path / "a.html")
    page = show(tmp_path / "a.html")
    for name in ("log y", "log x", "log y", "spectrum"):
        page.get_by_role("button", name=name).click()
        first(page)
        for key in ("a", ".", "+", "Home"):
            page.keyboard.press(key)
        assert all(page.evaluate("window.circ.state.plots[0].axes.map((axis) => axis._values.some((label) => label))"))
    assert page.evaluate("window.circ.panels[0].curves[0].y.length") == lines.count("\n")


def test_text_of_a_netlist_is_never_markup(tmp_path, show):
    netlist = tmp_path / "odd.cir"
    evil = "</script><!--<script>alert(1)</script>"
    netlist.write_text(f"{evil} \"q\" & ünïcode {{{{data}}}}\nv1 a<b 0 sin(0 1 1k)\nr1 a<b {evil} 1k\nd1 {evil} 0 m\n.model m d(ideal)\n.tran 10u 2m\n.end\n")
    run("sim", netlist, "-o", tmp_path / "odd.html")
    page = show(tmp_path / "odd.html")
    assert page.title().startswith(evil) and page.locator("h1").inner_text().startswith(evil)
    names = page.evaluate("window.circ.panels.flatMap((p) => p.curves.map((c) => c.name))")
    assert "v(a<b)" in names and f"v({evil})" in names
    assert page.locator(".circuit svg").count() == 1 and page.locator("script").count() == 2


def test_a_group_of_curves_is_shown_and_hidden_at_once(tmp_path, show):
    netlist = tmp_path / "many.cir"
    ladder = "".join(f"r{k} n{k - 1} n{k} 100\nc{k} n{k} 0 1n\n" for k in range(1, 12))
    netlist.write_text(f"many\nv1 n0 0 sin(0 1 1k)\n{ladder}.tran 10u 2m\n.end\n")
    run("sim", netlist, "-o", tmp_path / "many.html")
    page = show(tmp_path / "many.html")
    shown = "window.circ.panels.map((p) => p.curves.filter((c) => c.shown).length)"
    assert page.evaluate(shown) == [12, 1]
    group = page.get_by_role("checkbox", name="voltage", exact=True)
    group.uncheck()
    assert page.evaluate(shown) == [0, 1]
    page.get_by_role("checkbox", name="v(n3)", exact=True).check()
    assert page.evaluate(shown) == [1, 1] and group.evaluate("(g) => g.indeterminate")
    # The ninth of a panel has the colour of the first, in dashes; a panel begins anew.
    looks = page.evaluate("window.circ.panels.map((p) => p.curves.map((c) => [window.circ.colour(c), window.circ.dash(c).length]))")
    assert looks[0][8][0] == looks[0][0][0] == looks[1][0][0] and [looks[0][0][1], looks[0][8][1], looks[1][0][1]] == [0, 2, 0]


def test_the_spectrum_has_axes_of_its_own(buck, show):
    page = show(buck / "out.html")
    page.get_by_role("button", name="spectrum").click()
    bar = page.get_by_role("toolbar", name="axes of the spectrum")
    pressed = lambda: [b.get_attribute("aria-pressed") for b in bar.get_by_role("button").all()]
    assert pressed() == ["true", "false"]
    bar.get_by_role("button", name="log y").click()
    assert pressed() == ["true", "true"]
    labels = lambda: page.get_by_role("region", name="spectrum").locator(".panel").count()
    assert labels() == 3
    # What was chosen stays when the span changes.
    first(page)
    page.keyboard.press("+")
    assert pressed() == ["true", "true"] and labels() == 3


def test_a_spectrum_is_seen_where_it_is_asked_for(buck, show):
    page = show(buck / "out.html")
    for _ in range(2):
        page.evaluate("scrollTo(0, 0)")
        page.get_by_role("button", name="spectrum").click()
        first_panel = page.get_by_role("region", name="spectrum").locator(".panel").first
        top, bottom, height = first_panel.evaluate("(e) => [e.getBoundingClientRect().top, e.getBoundingClientRect().bottom, innerHeight]")
        assert 0 <= top and bottom <= height
        page.get_by_role("button", name="spectrum").click()


def test_labels_across_are_whole(tmp_path, show):
    netlist = tmp_path / "rc.cir"
    netlist.write_text("rc\nv1 in 0 sin(0 1 1meg)\nr1 in out 1k\nc1 out 0 1n\n.tran 10n 5u\n.end\n")
    run("sim", netlist, "-q", "-o", tmp_path / "rc.html")
    page = show(tmp_path / "rc.html")
    # The letter µ goes below the line: nothing of it may be cut off at the edge.
    ink = "(k) => { const c = document.querySelectorAll('.uplot canvas')[k]; return c.getContext('2d').getImageData(0, c.height - 1, c.width, 1).data.filter((v, i) => i % 4 === 3 && v > 0).length; }"
    assert [page.evaluate(ink, k) for k in range(page.locator(".uplot canvas").count())] == [0, 0]


def test_a_schematic_has_its_own_picture_on_the_page(tmp_path, show):
    run("sim", ROOT / "netlists/schematics/buck.asc", "-o", tmp_path / "buck.html")
    page = show(tmp_path / "buck.html")
    assert page.locator(".circuit .device[data-device=d1]").count() == 2
    first(page)
    page.keyboard.press("a")
    on = page.locator(".circuit .device[data-device=s1][data-on='1']").get_attribute("display")
    assert (on == "inline") == (cell(page, "s1", "a").inner_text() == "on")


def test_steps_and_comparisons_have_pages(tmp_path, show):
    netlist = tmp_path / "steps.cir"
    netlist.write_text("steps\nv1 in 0 1\nr1 in out {r}\nc1 out 0 1u ic=0\n.param r=1k\n.step param r list 1k 2k\n.tran 10u 1m uic\n.probe v(out)\n.meas tran top max v(out)\n.end\n")
    run("sim", netlist, "-o", tmp_path / "steps.html")
    page = show(tmp_path / "steps.html")
    names = page.evaluate("window.circ.panels[0].curves.map((c) => c.name)")
    assert len(names) == 2 and all(name.startswith("v(out)") for name in names)
    # The results of `.meas`, a line for each run.
    assert [line.split()[0] for line in page.locator("pre").first.inner_text().splitlines()] == ["r", "1000", "2000"]
    plain = tmp_path / "plain.cir"
    plain.write_text(SINE)
    run("sim", plain, "-o", tmp_path / "plain.csv")
    run("compare", plain, "--against", tmp_path / "plain.csv", "-o", tmp_path / "both.html", "-o", tmp_path / "both.svg")
    assert (tmp_path / "both.svg").read_text().startswith("<svg")
    page = show(tmp_path / "both.html")
    assert "difference" in page.evaluate("window.circ.panels.map((p) => p.quantity)")
    # The table of differences, and whether they are within the tolerance.
    rows = page.locator("table", has_text="edges shifted").locator("tbody tr")
    assert [row.split()[0] for row in rows.all_inner_texts()] == ["v(in)", "v(out)", "i(v1)"]
    assert "within the tolerance" in page.locator("pre").first.inner_text()


def test_what_is_seen_is_saved_as_a_drawing(buck, show):
    page = show(buck / "out.html")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="save SVG").click()
    drawing = waiting.value.path().read_text()
    assert drawing.startswith("<svg") and drawing.count("data-signal=") == 3 and "NaN" not in drawing


def test_a_drawing_shows_who_conducts_when(buck, show):
    page = show(buck / "out.html")
    for keys in ("", "+++++"):
        first(page)
        for key in keys:
            page.keyboard.press(key)
        drawing, [begin, end] = saved(page), view(page)
        lanes = {name: path for path, name in re.findall(r'<path d="([^"]*)" fill="#7fb3d5" data-strip="([^"]*)"', drawing)}
        strips = {strip["name"]: strip for strip in page.evaluate("window.circ.strips.map(({ name, times, states }) => ({ name, times: [...times], states }))")}
        assert list(lanes) == list(strips) == ["s1", "d1"] and all(f">{name}</text>" in drawing for name in lanes)
        for name, path in lanes.items():
            changes = [(t, on) for t, on in zip(strips[name]["times"], strips[name]["states"])] + [(end, False)]
            on = sum(max(0, min(b, end) - max(a, begin)) for (a, state), (b, _) in zip(changes, changes[1:]) if state)
            area = sum(float(high) * float(wide) for high, wide in re.findall(r"v-([\d.]+)h([\d.]+)V", path))
            room = float(re.search(r'<path d="M[\d.]+ [\d.]+h([\d.]+)" stroke="#ddd"/>', drawing)[1])
            assert area / (14 * room) == pytest.approx(on / (end - begin), abs=5e-3), (name, begin, end)


def test_a_million_rows_of_ten_signals_open(tmp_path, show):
    nodes = "".join(f"r{k} in n{k} {k}k\nc{k} n{k} 0 1n\n" for k in range(1, 10))
    netlist = tmp_path / "large.cir"
    netlist.write_text(f"large\nv1 in 0 sin(0 1 1k)\n{nodes}.tran 1u 1\n.save v(in) {' '.join(f'v(n{k})' for k in range(1, 10))}\n.end\n")
    run("sim", netlist, "-q", "-o", tmp_path / "large.html")
    page = show(tmp_path / "large.html")
    page.wait_for_function("!document.querySelector('p.about').innerText.includes('reading all rows')")
    assert page.evaluate("window.circ.panels.flatMap((p) => p.curves).map((c) => c.y.length)") == [1000001] * 10
    first(page)
    for _ in range(12):
        page.keyboard.press("+")
    assert view(page) == pytest.approx([0.5 - 2**-13, 0.5 + 2**-13])
    page.keyboard.press("a")
    t = float(cursor(page, "a"))
    assert float(reading(page, "v(in)", "a")) == pytest.approx(math.sin(2000 * math.pi * t), abs=1e-9)
    assert "reading all rows" not in page.locator("p.about").first.inner_text()
    # While its rows are still read the page stands, and shows no value that it does not know.
    whole = (tmp_path / "large.html").read_text()
    (tmp_path / "part.html").write_text(whole[:whole.index('<script type="text/plain"')] + "</body></html>")
    page = show(tmp_path / "part.html")
    assert "reading all rows" in page.locator("p.about").first.inner_text()
    assert page.get_by_role("button", name="spectrum").is_disabled()
    rows = page.evaluate("window.circ.panels.flatMap((p) => p.curves).map((c) => c.y.length)")
    assert all(1000 < some <= 4000 for some in rows)
    first(page)
    page.locator(".u-over").first.hover(position={"x": 333, "y": 50})
    assert reading(page, "v(in)", "pointer") in ("NaN", None)
    page.keyboard.press("a")
    t = float(cursor(page, "a"))
    assert float(reading(page, "v(in)", "a")) == pytest.approx(math.sin(2000 * math.pi * t), abs=1e-9)


def test_a_page_can_be_zoomed_while_its_rows_are_read(tmp_path, browser):
    nodes = "".join(f"r{k} in n{k} {k}k\nc{k} n{k} 0 1n\n" for k in range(1, 6))
    netlist = tmp_path / "long.cir"
    netlist.write_text(f"long\nv1 in 0 sin(0 1 1k)\n{nodes}.tran 1u 0.1\n.end\n")
    run("sim", netlist, "-q", "-o", tmp_path / "long.html")
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    partial = "window.circ.panels.flatMap((p) => p.curves).filter((c) => c.partial).length"
    # What was still to be read when the page stood.
    page.add_init_script(f"addEventListener('DOMContentLoaded', () => {{ window.left = {partial}; window.circ.show([0.01, 0.02]); }})")
    page.goto((tmp_path / "long.html").as_uri())
    assert page.evaluate("window.left") > 5
    page.wait_for_function(f"{partial} === 0 && !document.querySelector('p.about').innerText.includes('reading')")
    assert view(page) == pytest.approx([0.01, 0.02])
    assert set(page.evaluate("window.circ.panels.flatMap((p) => p.curves).map((c) => c.y.length)")) == {100001}
    page.close()


def test_the_page_is_usable_by_keyboard_alone(buck, show):
    page = show(buck / "out.html")
    names = []
    for _ in range(18):
        page.keyboard.press("Tab")
        names.append(page.evaluate("document.activeElement.getAttribute('aria-label') || document.activeElement.innerText || document.activeElement.type"))
    assert any("voltage: v(out)" in name for name in names) and "spectrum" in names and "checkbox" in names
    unnamed = page.evaluate("[...document.querySelectorAll('button, input, canvas[role=img]')].filter((e) => !(e.innerText || e.ariaLabel || e.labels?.length)).length")
    assert unnamed == 0


def test_the_circuit_shows_what_conducts_at_the_cursor(buck, show):
    page = show(buck / "out.html")
    assert page.locator(".circuit svg").count() == 1
    device = lambda name, on: page.locator(f".circuit .device[data-device={name}][data-on='{on}']").get_attribute("display")
    assert [device("s1", 1), device("d1", 1), device("s1", 0)] == ["none", "none", "inline"]
    seen = set()
    first(page)
    page.keyboard.press("a")
    for _ in range(60):
        page.keyboard.press(".")
        words = [cell(page, name, "a").inner_text() for name in ("s1", "d1")]
        states = [device("s1", 1) == "inline", device("d1", 1) == "inline"]
        assert states == [words[0] == "on", words[1] == "conducts"]
        assert device("d1", 0) == ("none" if states[1] else "inline")
        seen.add(tuple(states))
    assert {(True, False), (False, True)} <= seen
    page.keyboard.press("Escape")
    assert device("s1", 1) == "none"


def test_files_of_waveforms_have_pages(buck, tmp_path, show):
    run("view", buck / "out.csv", "-o", tmp_path / "view.html")
    page = show(tmp_path / "view.html")
    values = "(page) => page.panels.flatMap((p) => p.curves).map((c) => [c.name, Array.from(c.y.slice(0, 50))])"
    assert page.evaluate(f"({values})(window.circ)") == show(buck / "out.html").evaluate(f"({values})(window.circ)")


def test_a_watched_page_loads_anew_and_shows_the_same_part(tmp_path, show):
    netlist = tmp_path / "sine.cir"
    netlist.write_text(SINE)
    watching = subprocess.Popen([CIRC, "watch", "--no-open", netlist], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        page = show(watching.stdout.readline().strip(), waits=False)
        page.wait_for_function("window.circ !== undefined")
        first(page)
        page.keyboard.press("+")
        page.keyboard.press("a")
        page.locator(".readings tr[data-signal='v(out)'] input").uncheck()
        seen, at = view(page), cursor(page, "a")
        netlist.write_text(SINE.replace("0 3 1k", "0 4 1k"))
        page.wait_for_function("window.circ && boundsIn(window.circ.panels[0].curves[0], 0, 1)[1] > 3.5")
        assert view(page) == seen and cursor(page, "a") == at
        assert page.evaluate("window.circ.panels[0].curves.filter((c) => !c.shown).map((c) => c.name)") == ["v(out)"]
        assert not page.locator(".readings tr[data-signal='v(out)'] input").is_checked()
        netlist.write_text(SINE.replace("1n\n", "1 n\n"))
        page.wait_for_function("document.querySelector('[role=alert]') !== null")
        assert "sine.cir" in page.locator("[role=alert]").inner_text()
        netlist.write_text(SINE)
        page.wait_for_function("document.querySelector('[role=alert]') === null && window.circ !== undefined")
        assert view(page) == seen
    finally:
        watching.kill()
        watching.wait()


def test_error_over_time_and_certificates_have_pages(tmp_path, show):
    netlist = tmp_path / "sine.cir"
    netlist.write_text(SINE)
    run("bench", netlist, "--methods", "exact,theta", "-o", tmp_path / "bench.html", "-o", tmp_path / "bench.csv")
    page = show(tmp_path / "bench.html")
    table = [row.split(",") for row in (tmp_path / "bench.csv").read_text().splitlines()[1:]]
    theta = sorted((float(row[4]), float(row[5])) for row in table if row[1] == "theta" and row[2].startswith("step"))
    points = page.evaluate("(() => { const c = window.circ.panels[0].curves.find((c) => c.name === 'theta'); return Array.from(c.x, (x, k) => [x, c.y[k]]); })()")
    assert [tuple(point) for point in points] == theta
    assert page.evaluate("window.circ.axis.log && window.circ.state.logs.size === 2")
    run("check", BUCK, "-o", tmp_path / "check.html")
    page = show(tmp_path / "check.html", waits=False)
    page.get_by_role("cell", name="RR-7158 Theorem 2").wait_for()
    assert page.locator(".circuit svg").count() == 1 and "passive" in page.locator("pre").inner_text()


def test_names_stand_on_panels_and_keys_work_without_focus(buck, show):
    page = show(buck / "out.html")
    names = page.locator(".panel .names")
    shown = page.evaluate("window.circ.panels.map((p) => p.curves.map((c) => c.name).join(' '))")
    assert [" ".join(text.split()) for text in names.all_inner_texts()] == shown
    page.locator(".readings input").last.uncheck()
    pressed = names.last.get_by_role("button").evaluate_all("(all) => all.map((b) => b.getAttribute('aria-pressed'))")
    assert pressed[-1] == "false" and "false" not in pressed[:-1]
    whole = view(page)
    page.get_by_role("button", name="dark / light").click()
    page.keyboard.press("+")
    assert view(page)[1] - view(page)[0] == pytest.approx((whole[1] - whole[0]) / 2)
    page.keyboard.press("Home")
    assert view(page) == pytest.approx(whole)
    page.keyboard.press("a")
    assert "Cursor A" in page.locator("output.live").inner_text()
    page.keyboard.press("Escape")
    assert page.locator("output.live").inner_text() == ""


def test_dense_curves_have_no_gaps(tmp_path, show):
    netlist = tmp_path / "clock.cir"
    netlist.write_text("clock\nv1 a 0 24\nr1 a b 1\nv2 c 0 pulse(0 5 2.5m 10n 10n 0.5u 1u)\nr2 c b 1k\nc1 b 0 1u ic=0\n.tran 0 5m uic\n.save v(a) v(b)\n.end\n")
    run("sim", netlist, "-q", "-o", tmp_path / "clock.html")
    page = show(tmp_path / "clock.html")
    # Of each pixel of the panel there is a bar for either curve.
    gaps = page.evaluate("""() => window.circ.state.plots.flatMap((plot) => plot.panel.curves.map((curve) => {
        const taken = new Set(curve.bars.map(([left]) => left));
        return curve.bars.length === 0 ? -1 : Math.round(plot.bbox.width) - taken.size;
    }))""")
    assert gaps and all(0 <= gap <= 2 for gap in gaps)


def test_dense_switching_looks_alike_all_along(tmp_path, show):
    netlist = tmp_path / "gate.cir"
    netlist.write_text(
        "buck\nv1 in 0 24 rser=10m\nvg g 0 pulse(0 10 0 20n 20n 2.18u 10u)\ns1 in sw g 0 m\nd1 0 sw d\nl1 sw out 47u rser=20m\n"
        "c1 out 0 100u rser=5m lser=2n\nr1 out 0 2.5\n.model m sw(ron=10m roff=10meg vt=5 vh=0)\n.model d d(ron=20m roff=1meg vfwd=0.45)\n"
        ".tran 0 5m 0 100n\n.save v(sw) i(l1)\n.end\n"
    )
    run("sim", netlist, "-q", "-o", tmp_path / "gate.html")
    page = show(tmp_path / "gate.html")
    # Either every pulse is seen or a band, not now one and now the other: of 35 pixels some ten periods have their edges in.
    shares = """() => {
        const { plots } = window.circ.state, { bars } = plots[0].panel.curves[0];
        const heights = bars.slice(8, -8).map(([, top, bottom]) => bottom - top), most = Math.max(...heights);
        const tall = (from) => heights.slice(from, from + 35).filter((height) => height > most / 2).length / 35;
        return Array.from({ length: Math.floor(heights.length / 35) }, (_, k) => tall(35 * k));
    }"""
    pixels = page.evaluate("Math.round(window.circ.state.plots[0].bbox.width)")
    for periods in (pixels / width for width in (3.4, 3.5, 3.6, 3.7, 3.8, 3.9)):
        page.evaluate(f"window.circ.show([0.1e-3, {0.1e-3 + periods * 10e-6}])")
        page.wait_for_function("window.circ.state.plots[0].panel.curves[0].bars?.length > 0")
        found = page.evaluate(shares)
        assert len(found) > 20 and max(found) - min(found) < 0.2, (periods, found)


SWITCHED = """switched, and a sine
v1 in 0 5
vg g 0 pulse(0 1 0 1n 1n 10u 34u)
s1 in a g 0 sw
v2 b 0 sin(2.5 1.5 100)
r2 b 0 1k
r1 a 0 1k
.model sw sw(ron=1 roff=1meg vt=0.5)
.tran 100u 20m
.probe i(r2) i(r1)
.end
"""


@pytest.fixture(scope="module")
def switched(tmp_path_factory):
    """A current that is switched about every second pixel, and a sine in its midst, in one panel."""
    return page_of(tmp_path_factory.mktemp("switched"), SWITCHED)


def colours(canvas, y, box="0, c.width"):
    """The colours of a row of a canvas on white paper, as [r, g, b]."""
    return canvas.evaluate(f"""(c, y) => {{
        const [from, to] = [{box}];
        const paper = new OffscreenCanvas(c.width, c.height).getContext("2d", {{ willReadFrequently: true }});
        paper.fillStyle = "#fff";
        paper.fillRect(0, 0, c.width, c.height);
        paper.drawImage(c, 0, 0);
        const row = paper.getImageData(from, y, to - from, 1).data;
        return Array.from({{ length: to - from }}, (_, k) => Array.from(row.slice(4 * k, 4 * k + 3)));
    }}""", y)


def share(row):
    """The colour that most of a row has, and how much of it has it."""
    most = max(row, key=row.count)
    return most, row.count(most) / len(row)


def test_what_is_dense_is_pale_and_lies_below_other_curves(switched, show):
    page = show(switched)
    plot = "window.circ.state.plots[0]"
    assert page.evaluate(f"{plot}.panel.curves.map((c) => c.name)") == ["i(r2)", "i(r1)"]
    canvas = page.locator(".panel canvas").first
    box = f"Math.ceil({plot}.bbox.left) + 4, Math.floor({plot}.bbox.left + {plot}.bbox.width) - 4"
    full = page.evaluate("window.circ.panels[0].curves.map((c) => window.circ.colour(c)).map((c) => [1, 3, 5].map((k) => parseInt(c.slice(k, k + 2), 16)))")
    # Below the sine there is but the switched current, of one colour without gaps.
    colour, part = share(colours(canvas, page.evaluate(f"Math.round({plot}.valToPos(0.5e-3, 'y', true))"), box))
    assert part > 0.95
    assert colour != full[1] and sum(colour) > sum(full[1]) + 100
    # The sine is seen: at its top, and where it passes through the other's midst.
    for t, value in ((2.5e-3, 4e-3), (7.5e-3, 1e-3)):
        x, y = page.evaluate(f"[Math.round({plot}.valToPos({t}, 'x', true)), Math.round({plot}.valToPos({value}, 'y', true))]")
        seen = [colours(canvas, y + k, f"{x}, {x} + 1")[0] for k in (-2, -1, 0, 1, 2)]
        assert min(sum(abs(c - f) for c, f in zip(colour, full[0])) for colour in seen) < 40, (seen, full)


def test_strips_that_are_dense_have_no_pattern(switched, show):
    page = show(switched)
    canvas = page.locator("canvas.strip")
    left, right = page.evaluate("[window.circ.state.plots[0].bbox].map((b) => [Math.ceil(b.left) + 4, Math.floor(b.left + b.width) - 4])[0]")
    colour, part = share(colours(canvas, 7, f"{left}, {right}"))
    assert part > 0.95 and colour != [255, 255, 255]
    # Where periods can be told apart there are bars and gaps.
    first(page)
    for _ in range(5):
        page.keyboard.press("+")
    assert share(colours(canvas, 7, f"{left}, {right}"))[1] < 0.8


def test_names_on_panels_are_switches_and_tell_values(buck, show):
    page = show(buck / "out.html")
    name = page.locator(".panel .names").get_by_role("button", name="i(l1)")
    box = page.locator(".readings tr[data-signal='i(l1)'] input")
    is_shown = lambda: page.evaluate("window.circ.panels[2].curves[0].shown")
    name.click()
    assert not is_shown() and not box.is_checked() and name.get_attribute("aria-pressed") == "false"
    assert name.is_visible()
    name.focus()
    page.keyboard.press("Space")
    assert is_shown() and box.is_checked() and name.get_attribute("aria-pressed") == "true"
    # What is at the pointer stands beside the name, next to the curve; without a pointer what is at the cursors.
    beside = page.locator(".panel .names .value")
    assert beside.all_inner_texts() == [""] * 3
    page.mouse.move(*middle(page, 0.3))
    assert beside.first.inner_text() == cell(page, "v(out)", "pointer").inner_text() != ""
    page.mouse.click(*middle(page, 0.3))
    page.mouse.move(5, 5)
    assert beside.first.inner_text() == "A " + cell(page, "v(out)", "a").inner_text()
    page.keyboard.down("Shift")
    page.mouse.click(*middle(page, 0.7))
    page.keyboard.up("Shift")
    page.mouse.move(5, 5)
    assert beside.first.inner_text() == "B − A " + cell(page, "v(out)", "delta").inner_text()
    # Nothing has moved out of sight for that.
    assert page.evaluate("scrollY") == 0 and beside.last.bounding_box()["y"] < 900


def test_a_run_has_one_colour_in_all_panels(tmp_path, show):
    netlist = tmp_path / "steps.cir"
    netlist.write_text("steps\n.param r=1k\nv1 a 0 sin(0 1 1k)\nr1 a b {r}\nc1 b 0 1u\n.step param r list 1k 2k 3k\n.tran 10u 2m\n.probe v(a) v(b) i(r1)\n.end\n")
    run("sim", netlist, "-o", tmp_path / "steps.html")
    page = show(tmp_path / "steps.html")
    looks = page.evaluate("window.circ.panels.flatMap((p) => p.curves.map((c) => [c.name, c.run, window.circ.colour(c), window.circ.dash(c).join(' ')]))")
    colours_of = {run: {look[2] for look in looks if look[1] == run} for run in ("r=1000", "r=2000", "r=3000")}
    assert len(looks) == 9 and all(len(of) == 1 for of in colours_of.values()) and len(set.union(*colours_of.values())) == 3
    # Signals of a panel have dashes of their own, the same in all runs.
    dashes = {signal: {look[3] for look in looks if look[0].startswith(signal)} for signal in ("v(a)", "v(b)")}
    assert all(len(of) == 1 for of in dashes.values()) and dashes["v(a)"] != dashes["v(b)"]
    # In the spectrum a curve looks as above, with other runs hidden too.
    swatches = lambda of: of.locator(".names > span").evaluate_all("(all) => Object.fromEntries(all.map((s) => [s.querySelector('button').innerText, s.querySelector('.swatch').style.background]))")
    above = swatches(page.get_by_role("region", name="waveforms"))
    page.get_by_label("r=1000", exact=True).first.uncheck()
    page.get_by_role("button", name="spectrum").click()
    below = swatches(page.get_by_role("region", name="spectrum"))
    assert len(below) == 6 and below == {name: above[name] for name in below}


def test_long_labels_of_an_axis_have_room(buck, show):
    page = show(buck / "out.html")
    room = """() => window.circ.state.plots.map((plot) => {
        const ctx = document.createElement("canvas").getContext("2d");
        ctx.font = plot.axes[1].font[0];
        return plot.axes[1]._size - Math.max(...plot.axes[1]._values.map((label) => (label ? ctx.measureText(label).width / devicePixelRatio : 0)));
    })"""
    lefts = "window.circ.state.plots.map((plot) => plot.bbox.left)"
    before = page.evaluate(lefts)
    page.evaluate("(() => { const c = window.circ; c.state.heights.set(c.panels[1], [5.682301, 5.682309]); c.show(c.state.view); })()")
    assert max(map(len, page.evaluate("window.circ.state.plots[1].axes[1]._values"))) >= 10
    # Ticks take 10 pixels, the gap to a label 5.
    assert all(free >= 15 for free in page.evaluate(room))
    # All panels have the same axis across, and get back what the labels took.
    after = page.evaluate(lefts)
    assert len(set(after)) == 1 and after[0] > before[0]
    first(page)
    page.keyboard.press("Home")
    assert page.evaluate(lefts) == before


def test_what_is_tiny_has_an_axis(tmp_path, show):
    lines = "".join(f"{k}e-3,5,{5 + k % 2 * 8.9e-16!r},{(k % 3 - 1) * 1e-19!r},{k * 1e-26!r}\n" for k in range(10))
    (tmp_path / "a.csv").write_text("time,v(a),v(b),i(v1),i(v2)\n" + lines)
    run("view", tmp_path / "a.csv", "-o", tmp_path / "a.html")
    page = show(tmp_path / "a.html")
    labels = lambda: page.evaluate("Object.fromEntries(window.circ.state.plots.map((plot) => [plot.panel.curves[0].name, plot.axes[1]._values]))")
    lefts = "window.circ.state.plots.map((plot) => plot.bbox.left)"
    seen = labels()
    assert "-1e-19 A" in seen["i(v1)"] and "0 A" in seen["i(v1)"] and "1e-19 A" in seen["i(v1)"]
    assert "4e-26 A" in seen["i(v2)"] and len(set(seen["i(v2)"])) > 3
    assert len(set(page.evaluate(lefts))) == 1
    # What differs by rounding alone is a straight line.
    assert bounds(page, 0) == pytest.approx([4.5, 5.5]) and len(set(seen["v(a)"])) > 3
    page.mouse.move(*middle(page, 2.05 / 9))
    page.keyboard.press("a")
    assert cell(page, "i(v1)", "a").inner_text() == "1e-19 A"
    page.get_by_role("button", name="log y").click()
    assert "1e-19 A" in labels()["i(v1)"] and len(set(page.evaluate(lefts))) == 1
    # A height is dragged down to what can be told apart.
    page.get_by_role("button", name="log y").click()
    for _ in range(30):
        box = page.locator(".panel .u-over").first.bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"]
        drag(page, (x, y + 0.45 * box["height"]), (x, y + 0.6 * box["height"]))
    low, high = bounds(page, 0)
    assert 1e-13 < high - low < 1e-10 and len(labels()["v(a)"]) > 2


@pytest.mark.parametrize(("series", "height"), [(1e-15, 0.2), (1e-3, 9.7e-5)])
def test_a_flat_response_has_an_axis(series, height, tmp_path, show):
    (tmp_path / "a.cir").write_text(f"flat\nv1 in 0 dc 0 ac 1\nr1 in out {series}\nr2 out mid 100\nc1 mid 0 1u\n.ac dec 10 10 100k\n.end\n")
    run("ac", tmp_path / "a.cir", "-o", tmp_path / "a.html", "--probe", "v(out)")
    page = show(tmp_path / "a.html")
    low, high = bounds(page, 0)
    assert high - low == pytest.approx(height, rel=0.1)
    assert all(len(set(labels)) > 2 for labels in page.evaluate("window.circ.state.plots.map((plot) => plot.axes[1]._values)"))


def test_a_cursor_says_who_conducts_and_the_circuit_has_a_name(buck, show):
    page = show(buck / "out.html")
    page.mouse.click(*middle(page, 0.31))
    told = page.locator("output[aria-live]").inner_text()
    assert all(f"{name} {cell(page, name, 'a').inner_text()}" in told for name in ("s1", "d1"))
    picture = page.get_by_role("img", name="circuit diagram of Buck converter, 12 V to 5 V, 50 kHz")
    assert picture.count() == 1 and picture.evaluate("(picture) => picture.localName") == "svg"


def test_only_time_has_means_and_frequencies(tmp_path, show):
    (tmp_path / "sine.cir").write_text(SINE)
    run("bench", tmp_path / "sine.cir", "--methods", "exact,theta", "-o", tmp_path / "bench.html")
    page = show(tmp_path / "bench.html")
    for name, part in (("a", 0), ("b", 1)):
        page.evaluate(f"window.circ.place('{name}', window.circ.state.view[{part}])")
    delta = page.locator(".readings thead [data-at=delta]").inner_text()
    assert delta.startswith("B − A ") and delta.endswith("s") and "Hz" not in delta
    assert page.locator(".readings [data-at=mean], .readings [data-at=rms]").count() == 0


def saved(page):
    with page.expect_download() as waiting:
        page.get_by_role("button", name="save SVG").click()
    return waiting.value.path().read_text()


def test_a_spectrum_that_is_seen_is_saved_too(buck, show):
    page = show(buck / "out.html")
    page.get_by_role("button", name="spectrum").click()
    drawing = saved(page)
    assert drawing.count("data-signal=") == 6 and ">Spectrum</text>" in drawing and "MHz</text>" in drawing and "NaN" not in drawing
    page.get_by_role("button", name="spectrum").click()
    drawing = saved(page)
    assert drawing.count("data-signal=") == 3 and ">Spectrum</text>" not in drawing and "MHz</text>" not in drawing


def test_a_drawing_shows_what_is_dense_pale(switched, show):
    drawing = saved(show(switched))
    assert drawing.count("fill-opacity") >= 1 and drawing.index("fill-opacity") < drawing.index("data-signal=")
    assert len(drawing) < 1_000_000


def test_long_tables_have_a_scroll_of_their_own(buck, show):
    page = show(buck / "out.html")
    page.get_by_text("Events (").click()
    events = page.get_by_role("region", name="Events")
    height = lambda: events.bounding_box()["height"]
    assert height() < 450 < events.evaluate("(e) => e.scrollHeight")
    events.focus()
    assert events.evaluate("(e) => e === document.activeElement")
    page.keyboard.press("End")
    page.wait_for_function("document.querySelector('.scroll:focus').scrollTop > 0")
    # Its heading stays.
    assert events.locator("th").first.bounding_box()["y"] == pytest.approx(events.bounding_box()["y"], abs=1)
    page.emulate_media(media="print")
    assert height() > 1000


def test_paper_has_all_of_a_chart(buck, show):
    page = show(buck / "out.html", color_scheme="dark")
    page.set_viewport_size({"width": 1600, "height": 900})
    widths = "[...document.querySelectorAll('.uplot canvas, canvas.strip')].map((canvas) => canvas.width)"
    page.wait_for_function(f"{widths}.every((width) => width > 1500)")
    before = page.evaluate(widths)
    page.evaluate(f"addEventListener('beforeprint', () => {{ window.printed = {widths}; }})")
    # A4 has 794 pixels, less its margins; what was drawn for a much wider one would have letters too small to read.
    page.pdf(format="A4", margin={side: "1cm" for side in ("left", "right", "top", "bottom")})
    printed = page.evaluate("window.printed")
    assert len(printed) == 4 and all(600 < width < 720 for width in printed)
    assert page.evaluate(widths) == before
    # On a smaller sheet they are shrunk, and on a wider one there are no gaps.
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    for sheet in (450, 720, 880):
        page.evaluate(f"document.body.style.width = '{sheet}px'")
        boxes = [canvas.bounding_box() for canvas in page.locator(".uplot canvas, canvas.strip").all()]
        assert all(box["width"] == pytest.approx(sheet, abs=1) for box in boxes)
        assert all(high["y"] + high["height"] <= low["y"] for high, low in zip(boxes, boxes[1:]))
        left, edge = page.evaluate("(() => { const plot = window.circ.state.plots[0]; return [plot.bbox.left / plot.width, document.querySelector('.names > span').getBoundingClientRect().left - plot.root.getBoundingClientRect().left]; })()")
        assert edge == pytest.approx(left * sheet, abs=2)
    assert page.locator(".swatch").first.evaluate("(swatch) => getComputedStyle(swatch).printColorAdjust") == "exact"


@pytest.mark.parametrize(("a", "b"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_letters_of_cursors_stand_apart(buck, show, a, b):
    page = show(buck / "out.html")
    page.evaluate("""() => {
        const write = CanvasRenderingContext2D.prototype.fillText;
        window.written = {};
        CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
            const width = this.measureText(text).width;
            if (text === "A" || text === "B") window.written[text] = this.textAlign === "right" ? [x - width, x] : [x, x + width];
            return write.call(this, text, x, y);
        };
    }""")
    page.evaluate(f"(() => {{ const c = window.circ; c.place('a', 1e-3 + {a} * 1e-5); c.place('b', 1e-3 + {b} * 1e-5); }})()")
    page.wait_for_function("'A' in window.written && 'B' in window.written")
    one, other = page.evaluate("[window.written.A, window.written.B]")
    assert one[1] <= other[0] or other[1] <= one[0]
    if a != b:
        assert (one[0] < other[0]) == (a < b)
