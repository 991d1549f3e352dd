"""Who conducts when: shares of time where periods are too close to be told apart, bars where they are not."""

import re

import pytest
from conftest import page_of
from test_page import cell, colours, first, middle, saved

PWM = """one leg with a sine for its duty
vr ref 0 sin(0 0.8 50)
vc car 0 pulse(-1 1 0 25u 25u 1n 50u)
vdc p 0 400
s1 p sw ref car swm
s2 sw 0 car ref swm
l1 sw out 1m
c1 out 0 10u
r1 out 0 20
.model swm sw(ron=10m roff=1meg vt=0)
.tran 10u 40m
.probe v(out) i(l1)
.end
"""


@pytest.fixture(scope="module")
def leg(tmp_path_factory):
    """800 periods of a duty that goes from 10 to 90 %, 0.75 of one a pixel."""
    return page_of(tmp_path_factory.mktemp("leg"), PWM)


def lane(page, t, k=0):
    """The place on the page of lane k at t."""
    box = page.locator("canvas.strip").bounding_box()
    left = page.evaluate(f"(() => {{ const b = window.circ.state.plots[0]; return b.valToPos({t}, 'x') + b.over.getBoundingClientRect().left; }})()")
    return left, box["y"] + 20 * k + 12


def test_the_share_of_time_is_seen_and_told(leg, show):
    page = show(leg)
    canvas = page.locator("canvas.strip")
    tip = page.locator(".tip")
    bar = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--bar').trim()")
    bar = [int(bar[k:k + 2], 16) for k in (1, 3, 5)]
    for t, duty in ((5e-3, 0.9), (15e-3, 0.1), (20e-3, 0.5)):
        x = round(lane(page, t)[0] - canvas.bounding_box()["x"])
        # The bar is 14 pixels high and stands on its lane's line.
        for k, share in ((0, duty), (1, 1 - duty)):
            full = sum(colours(canvas, 20 * k + 5 + y, f"{x}, {x} + 1")[0] == bar for y in range(14))
            assert full == pytest.approx(14 * share, abs=1.5), (t, k)
        page.mouse.move(*lane(page, t))
        told = re.fullmatch(r"s1: on ([\d.]+) % of the time, ([\d.]+) kHz \(from .* to .*\)", tip.inner_text())
        assert float(told[1]) == pytest.approx(100 * duty, abs=2) and float(told[2]) == pytest.approx(20, rel=0.05)
        assert cell(page, "s1", "pointer").inner_text() == f"on {told[1]} %"
        assert cell(page, "s2", "pointer").inner_text().startswith("on ")
    page.mouse.move(5, 5)
    assert tip.is_hidden() and cell(page, "s1", "pointer").inner_text() == ""


def test_bars_are_exact_where_they_can_be_told_apart(leg, show):
    page = show(leg)
    pieces = "(() => { const s = window.circ.strips[0]; return pieces(s, window.circ.state.view, (a, b) => (b - a) / (window.circ.state.view[1] - window.circ.state.view[0]) * 1000 < LANES.period); })()"
    assert any("changes" in piece for piece in page.evaluate(pieces))
    page.evaluate("window.circ.show([19.9e-3, 20.4e-3])")
    seen = page.evaluate(pieces)
    times = page.evaluate("Array.from(window.circ.strips[0].times)")
    assert len(seen) > 15 and not any("changes" in piece for piece in seen)
    assert all(piece["from"] in times and piece["to"] in times for piece in seen)
    on = next(piece for piece in seen[3:] if piece["on"])
    page.mouse.move(*lane(page, (on["from"] + on["to"]) / 2))
    told = page.locator(".tip").inner_text()
    assert told.startswith("s1: on from ") and " µs" in told and "%" not in told
    assert cell(page, "s1", "pointer").inner_text() == "on"


def test_a_lane_takes_cursors_and_tells_the_share_between_them(leg, show):
    page = show(leg)
    page.mouse.click(*lane(page, 20e-3))
    page.keyboard.down("Shift")
    page.mouse.click(*lane(page, 40e-3 - 1e-6))
    page.keyboard.up("Shift")
    a, b = page.evaluate("[window.circ.state.cursors.a, window.circ.state.cursors.b]")
    assert abs(a - 20e-3) < 5e-5 and abs(b - 40e-3) < 5e-5
    # Of a whole period of the sine it is on for one half.
    share = float(cell(page, "s1", "mean").get_attribute("data-value"))
    assert share == pytest.approx(0.5, abs=0.01) and cell(page, "s1", "mean").inner_text() == f"on {float(f'{100 * share:.4g}'):g} %"
    steps = page.evaluate("(() => { const s = window.circ.strips[0]; return [Array.from(s.times), s.states, s.start]; })()")
    on, last, was = 0.0, a, None
    for t, state in zip(*steps[:2]):
        if t <= a:
            was = state
            continue
        on += (min(t, b) - last) * bool(was)
        last, was = min(t, b), state
    on += max(b - last, 0) * bool(was)
    assert share == pytest.approx(on / (b - a), rel=1e-9)


def test_bursts_keep_their_gaps(tmp_path, show):
    page = show(page_of(tmp_path, "bursts\nv1 a 0 1\nvg g 0 pulse(0 1 0 1n 1n 2u 5u)\nve e 0 pulse(0 1 0 1n 1n 2m 5m)\ns1 a b g 0 sw\ns2 b c e 0 sw\nr1 c 0 1k\nbq q 0 v=(v(g)>0.5)*(v(e)>0.5)\ns3 a d q 0 sw\nr3 d 0 1k\n.model sw sw(ron=1 roff=1meg vt=0.5)\n.tran 10u 20m\n.probe v(d)\n.end\n"))
    for t, told in ((1e-3, "s3: on 40"), (3e-3, "s3: off from "), (6e-3, "s3: on 40")):
        page.mouse.move(*lane(page, t, page.evaluate("window.circ.strips.findIndex((s) => s.name === 's3')")))
        assert page.locator(".tip").inner_text().startswith(told)


def test_many_lanes_are_drawn_within_a_frame_or_two(leg, show):
    page = show(leg)
    # 40 lanes of 20,000 changes each, as many as a page may have (a million).
    took = page.evaluate("""() => {
        const times = Array.from({ length: 20000 }, (_, k) => 40e-3 * k / 20000), states = times.map((_, k) => k % 2);
        const strips = stripsOf(Array.from({ length: 40 }, (_, k) => ({ name: `s${k}`, on: "on", off: "off", start: false, times, states })));
        const canvas = document.createElement("canvas"), view = [0, 40e-3], position = (t) => 100 + 1000 * t / 40e-3;
        const draw = () => drawLanes(canvas, strips, { view, width: 1100, left: 100, room: 1000, position, timeAt: (x) => (x - 100) * 40e-6, isClose: (a, b) => position(b) - position(a) < LANES.period }, []);
        draw();
        const start = performance.now();
        for (let k = 0; k < 5; k++) draw();
        return (performance.now() - start) / 5;
    }""")
    assert took < 250, took


STEPS = """a buck with three duties
.param d=0.3
vin in 0 24
vg g 0 pulse(0 1 0 1n 1n {d*10u} 10u)
s1 in sw g 0 sm
d1 0 sw di
l1 sw out 100u
c1 out 0 10u
r1 out 0 5
.model sm sw(vt=0.5 ron=10m)
.model di d(ideal)
.step param d list 0.3 0.5 0.7
.tran 1u 0.2m
.probe v(out) i(l1)
.end
"""


def test_runs_of_step_have_lanes_circuit_and_events_of_the_chosen_one(tmp_path, show):
    page = show(page_of(tmp_path, STEPS))
    choice = page.locator(".which select")
    assert choice.locator("option").all_inner_texts() == ["d=0.3", "d=0.5", "d=0.7"] and choice.input_value() == "d=0.3"
    page.evaluate("window.circ.show([0.1e-3, 0.12e-3])")
    first(page)
    page.mouse.click(*lane(page, 0.104e-3))
    device = lambda name: page.locator(f".circuit .device[data-device={name}][data-on='1']").get_attribute("display")
    events = lambda: page.locator("details[data-run]:visible > summary").all_inner_texts()
    bars = lambda: page.evaluate("(() => { const c = document.querySelector('canvas.strip'); return c.toDataURL(); })()")
    before = bars()
    assert (cell(page, "s1", "a").inner_text(), device("s1"), device("d1")) == ("off", "none", "inline")
    assert len(events()) == 1 and events()[0].startswith("Events of d=0.3 (")
    choice.select_option("d=0.5")
    assert (cell(page, "s1", "a").inner_text(), device("s1"), device("d1")) == ("on", "inline", "none")
    assert bars() != before and len(events()) == 1 and events()[0].startswith("Events of d=0.5 (")
    assert "d=0.5" in page.locator("canvas.strip").get_attribute("aria-label")
    # Shares of time between the cursors are those of the chosen run, and the drawing says of which.
    page.keyboard.down("Shift")
    page.mouse.click(*lane(page, 0.114e-3))
    page.keyboard.up("Shift")
    a, b = (float(page.locator(f"th[data-at={name}]").get_attribute("data-value")) for name in "ab")
    assert b > a
    share = lambda: float(re.search(r"on ([\d.]+) %", cell(page, "s1", "mean").inner_text())[1])
    half = share()
    choice.select_option("d=0.7")
    assert share() > half + 5
    drawing = saved(page)
    assert ">d=0.7</text>" in drawing and 'data-strip="s1"' in drawing
    kept = page.evaluate("JSON.stringify(window.circ.keep())")
    choice.select_option("d=0.3")
    page.evaluate(f"window.circ.restore({kept})")
    assert choice.input_value() == "d=0.7" and cell(page, "s1", "a").inner_text() == "on"


def test_a_page_of_one_run_has_no_choice(leg, show):
    assert show(leg).locator(".which").count() == 0
