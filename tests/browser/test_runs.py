"""Pages of many runs, and of signals of different sizes."""

import pytest
from conftest import page_of
from test_page import middle, saved

STEPS = "steps\n.param r=1k\nv1 a 0 sin(0 1 1k)\nr1 a b {r}\nc1 b 0 1u\n.step param r 0.5k 4k 0.1k\n.tran 10u 2m\n.probe v(a) v(b) i(r1)\n.end\n"


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    return page_of(tmp_path_factory.mktemp("many"), STEPS)


def test_many_runs_have_a_legend_that_scrolls_and_folds(many, show):
    page = show(many)
    legend = page.get_by_role("group", name="runs")
    names = legend.get_by_role("button")
    assert names.count() == 36 and names.first.inner_text() == "r=500" and names.last.inner_text() == "r=4000"
    assert legend.bounding_box()["height"] < 110
    # Panels name signals alone: both are seen without scrolling.
    assert page.locator(".panel .names").all_inner_texts()[1].strip() == "i(r1)"
    assert page.locator(".panel").last.bounding_box()["y"] < 500
    # Colours go along a scale in the order of the values: none twice, and neighbours are closer than ends.
    looks = page.evaluate("window.circ.panels[1].curves.map((c) => window.circ.colour(c))")
    rgb = [[int(c[k:k + 2], 16) for k in (1, 3, 5)] for c in looks]
    away = lambda a, b: sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5
    assert len(set(looks)) == 36
    assert max(away(a, b) for a, b in zip(rgb, rgb[1:])) < 0.15 * away(rgb[0], rgb[-1])
    page.get_by_text("36 runs").click()
    assert legend.is_hidden()
    assert page.locator(".readings").bounding_box()["height"] < 450


def test_a_click_shows_a_run_alone(many, show):
    page = show(many)
    shown = lambda: page.evaluate("[...new Set(window.circ.panels.flatMap((p) => p.curves).filter((c) => c.shown).map((c) => c.run))]")
    name = page.get_by_role("group", name="runs").get_by_role("button", name="r=1000", exact=True)
    highest = lambda: page.evaluate("window.circ.state.plots[1].scales.y.max")
    before = highest()
    name.click()
    assert shown() == ["r=1000"] and highest() < 0.7 * before
    # Its values stand beside the names of signals then.
    page.mouse.move(*middle(page, 0.125))
    assert page.locator(".panel .names .value").first.inner_text() == "1 V"
    name.click()
    assert len(shown()) == 36
    page.get_by_role("checkbox", name="show r=1000", exact=True).uncheck()
    assert len(shown()) == 35 and "r=1000" not in shown()
    # A signal of all runs, and back; what is hidden stays so.
    signal = page.locator(".panel .names").first.get_by_role("button", name="v(a)", exact=True)
    signal.click()
    assert page.evaluate("window.circ.panels[0].curves.some((c) => c.shown && c.name.startsWith('v(a)'))") is False
    signal.click()
    assert len(shown()) == 35


def test_the_run_nearest_to_the_pointer_is_named(many, show):
    page = show(many)
    plot = "window.circ.state.plots[1]"
    # A pointer stands on whole pixels: these curves are more than two from their neighbours, and nothing is below the last one.
    for run, below in (("r=500", 0), ("r=800", 0), ("r=1200", 0), ("r=4000", 3)):
        x, y = page.evaluate(f"""(() => {{
            const plot = {plot}, curve = plot.panel.curves.find((c) => c.run === "{run}"), box = plot.over.getBoundingClientRect(), t = 0.25e-3;
            plot.root.scrollIntoView({{ block: "center" }});
            const now = plot.over.getBoundingClientRect();
            return [now.left + plot.valToPos(t, "x"), now.top + plot.valToPos(valueAt(curve, t), "y")];
        }})()""")
        page.mouse.move(x, y + below)
        assert page.locator(".panel").nth(1).locator(".value").inner_text().startswith(f"{run}: ")


def test_a_drawing_of_many_runs_names_each_once(many, show):
    drawing = saved(show(many))
    assert drawing.count("data-signal=") == 108 and drawing.count(">r=500</text>") == 1 and drawing.count(">v(a)</text>") == 1


CONVERTER = """400 V to 12 V
v1 in 0 400
b1 x 0 v=12+0.02*sin(6.2832e5*time)
rx x out 1m
r1 out 0 10
r2 in mid 10k
r3 mid 0 30k
.tran 0.1u 0.1m
.probe v(in) v(mid) v(out) i(r1)
.end
"""


def test_a_small_ripple_is_seen_without_a_click(tmp_path, show):
    page = show(page_of(tmp_path, CONVERTER))
    names = page.evaluate("window.circ.panels.map((p) => [p.quantity, p.curves.map((c) => c.name)])")
    assert names == [["voltage", ["v(out)"]], ["voltage 2", ["v(in)", "v(mid)"]], ["current", ["i(r1)"]]]
    low, high = page.evaluate("(() => { const y = window.circ.state.plots[0].scales.y; return [y.min, y.max]; })()")
    assert 11.9 < low < 11.98 and 12.02 < high < 12.1


def test_an_axis_is_fitted_to_one_signal(tmp_path, show):
    page = show(page_of(tmp_path, "two\nv1 a 0 sin(0 10 1k)\nr1 a b 9k\nr2 b 0 1k\n.tran 10u 2m\n.end\n"))
    highest = lambda: page.evaluate("window.circ.state.plots[0].scales.y.max")
    assert page.evaluate("window.circ.panels[0].curves.map((c) => c.name)") == ["v(a)", "v(b)"] and highest() > 10
    fit = page.get_by_role("button", name="fit the axis to v(b)")
    fit.click()
    assert 1 < highest() < 1.2 and fit.get_attribute("aria-pressed") == "true"
    # It follows what is seen, and both stay.
    page.evaluate("window.circ.show([0, 0.05e-3])")
    assert highest() < 0.4 and page.evaluate("window.circ.panels[0].curves.every((c) => c.shown)")
    # A page that is loaded anew keeps it.
    kept = page.evaluate("window.circ.keep()")
    page.keyboard.press("Home")
    assert highest() > 10 and fit.get_attribute("aria-pressed") == "false"
    page.evaluate("(kept) => window.circ.restore(kept)", kept)
    assert highest() < 0.4
    fit.click()
    assert highest() > 2


def test_a_double_click_shows_a_curve_alone_in_its_panel(tmp_path, show):
    page = show(page_of(tmp_path, "two\nv1 a 0 sin(0 10 1k)\nr1 a b 9k\nr2 b 0 1k\n.tran 10u 2m\n.probe v(a) v(b) i(r1)\n.end\n"))
    shown = lambda: page.evaluate("window.circ.panels.flatMap((p) => p.curves).filter((c) => c.shown).map((c) => c.name)")
    name = page.locator(".panel .names").first.get_by_role("button", name="v(b)", exact=True)
    name.dblclick()
    assert shown() == ["v(b)", "i(r1)"]
    assert not page.locator(".readings tr[data-signal='v(a)'] input").is_checked()
    name.dblclick()
    assert shown() == ["v(a)", "v(b)", "i(r1)"]
    name.focus()
    page.keyboard.press("Shift+Enter")
    assert shown() == ["v(b)", "i(r1)"]
