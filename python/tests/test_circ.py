"""Every call of the contract, wrong input included."""

import math
import os
import pickle
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import circ
from circ import _sweep

FILTER = "filter\n.param top=1\nv1 in 0 {top}\nr1 in out 1k\nc1 out 0 1u\n.tran 0.1m 5m uic\n.meas tran last find v(out) at=5m\n.end\n"

BUCK = """buck
.param d=0.4
vi in 0 12
vg g 0 pulse(0 5 0 0 0 {d*10u} 10u)
s1 in x g 0 sw
d1 0 x di
l1 x out 47u
c1 out 0 100u
r1 out 0 3
.model sw sw(ron=1m roff=1meg vt=2.5)
.model di d(ron=1m roff=1meg)
.tran 1u 2m uic
.meas tran vout avg v(out) from=1.9m to=2m
.save v(out) i(l1)
.end
"""


def test_a_transient_is_its_closed_form():
    w = circ.parse(FILTER).tran()
    assert w.time.dtype == np.float64 and w["v(out)"].dtype == np.float64
    assert np.allclose(w["v(out)"], 1 - np.exp(-w.time / 1e-3), atol=1e-14)
    assert w.measures["last"] == pytest.approx(1 - math.exp(-5), abs=1e-14)
    assert abs(w.energy["residual_relative"]) < 1e-12
    assert w.notes == [] and "v(out)" in w and len(w) == 51
    assert "v(out)" in w._repr_html_()
    with pytest.raises(KeyError, match="v\\(nowhere\\)"):
        w["v(nowhere)"]


def test_stop_step_method_and_probes():
    m = circ.parse(FILTER)
    w = m.tran(stop=1e-3, step=1e-4, method="theta", probes=["v(out)"])
    assert w.names == ["v(out)"] and w.time[-1] == 1e-3 and len(w) == 11
    assert w["v(out)"][-1] == pytest.approx(1 - math.exp(-1), rel=1e-3)
    assert m.tran(method="euler", fixed=1e-6).summary["method"] == "euler"
    with pytest.raises(ValueError, match="no method"):
        m.tran(method="fast")
    with pytest.raises(KeyError, match="nowhere"):
        m.tran(probes=["v(nowhere)"])
    w = m.tran(probes=["v(o*)", "2*v(out)"])
    assert w.names == ["v(out)", "2*v(out)"] and (w["2*v(out)"] == 2 * w["v(out)"]).all()
    with pytest.raises(KeyError, match="did you mean `v\\(out\\)`"):
        m.tran(probes=["v(uot)"])


def test_values_are_set_without_parsing():
    m = circ.parse(FILTER, params={"top": 2.0})
    assert m.tran()["v(in)"][0] == 2.0
    m.set("top", 3.0)
    m.set("R1", 2e3)
    assert m.value("r1") == 2e3 and m.value("c1") == pytest.approx(1e-6)
    w = m.tran()
    assert np.allclose(w["v(out)"], 3 * (1 - np.exp(-w.time / 2e-3)), atol=1e-13)
    with pytest.raises(circ.NetlistError):
        m.set("r7", 1.0)
    for nothing in (math.nan, math.inf):
        with pytest.raises(circ.NetlistError, match="no number"):
            m.set("r1", nothing)
    assert m.value("r1") == 2e3
    with pytest.raises(KeyError):
        m.value("r7")


def test_models_are_pickled_with_what_was_set():
    m = circ.parse(BUCK, params={"d": 0.3})
    m.set("r1", 4.0)
    other = pickle.loads(pickle.dumps(m))
    assert other.tran()["v(out)"].tobytes() == m.tran()["v(out)"].tobytes()


def test_files_are_read(tmp_path):
    (tmp_path / "values.inc").write_text(".param r=2k\n")
    path = tmp_path / "main.cir"
    path.write_text("main\n.include values.inc\nv1 a 0 1\nr1 a 0 {r}\n.op\n.end\n")
    m = circ.load(path)
    assert m.op()["currents"]["i(r1)" if "i(r1)" in m.op()["currents"] else "r1"] == pytest.approx(0.5e-3)
    (tmp_path / "values.inc").unlink()
    assert pickle.loads(pickle.dumps(m)).value("r1") == 2e3
    with pytest.raises(circ.NetlistError):
        circ.load(tmp_path / "missing.cir")


def test_netlist_errors_have_their_diagnostics():
    with pytest.raises(circ.NetlistError) as raised:
        circ.parse("bad\nr1 a 0\nv1 a 0 1\n.end\n", name="bad.cir")
    first = raised.value.diagnostics[0]
    assert first["file"] == "bad.cir" and first["line"] == 2 and first["column"] >= 1
    assert set(first) >= {"code", "severity", "message", "file", "line", "column", "help"}
    assert "bad.cir:2" in raised.value._repr_html_()
    with pytest.raises(ValueError, match="(?i)nan"):
        circ.parse(FILTER, params={"top": math.nan})
    with pytest.raises(ValueError, match="no diodes"):
        circ.parse(FILTER, diodes="soft")


def test_simulation_errors_have_kind_time_and_device():
    text = "impossible\ni1 0 a pwl(0 -1 2m 1)\nd1 0 a di\n.model di d(ideal)\n.tran 0.5m 2m\n.end\n"
    with pytest.raises(circ.SimulationError) as raised:
        circ.parse(text).tran()
    error = raised.value
    assert error.time == pytest.approx(1e-3, rel=1e-6) and isinstance(error.kind, str) and error.device in ("d1", "i1")


def test_the_system_is_in_numpy_arrays():
    l = circ.parse(BUCK).lcs()
    for letter in "ABCDEGP":
        matrix = getattr(l, letter)
        assert matrix.dtype == np.float64 and matrix.flags["C_CONTIGUOUS"]
    assert l.A.shape == (2, 2) and l.C.shape == (1, 2) and l.E.shape == (2, 2)
    names = [s["name"] for s in l.states]
    i, v = names.index("i(l1)"), names.index("v(c1)")
    assert l.A[v, i] == pytest.approx(1e4) and l.A[v, v] == pytest.approx(-1 / 300e-6)
    assert l.ports[0]["device"] == "d1" and l.switches == {"s1": "off"}
    assert "i(l1)" in l._repr_html_()


def test_op_check_table_and_sensitivity():
    m = circ.parse(FILTER)
    assert m.op()["nodes"]["out"] == pytest.approx(1.0)
    report = m.check()
    assert report["ok"] and report["passive"] and report["size"] == {"n": 1, "m": 0, "p": 1}
    table = m.table()
    # ∫ i² R over five time constants.
    assert table["r1"]["power"] == pytest.approx(1e-3 * 1e-3 / 2 * (1 - math.exp(-10)) / 5e-3, rel=1e-9)
    g = m.sensitivity(of=["last"], to=["r1", "top"])
    to = g["of"]["last"]["to"]
    assert to["top"] == pytest.approx(1 - math.exp(-5), rel=1e-6)
    assert to["r1"] == pytest.approx(-5 * math.exp(-5) / 1e3, rel=1e-5)
    # C V²/2T of the resistor does not depend on it once C is charged.
    g = m.sensitivity(of=["table.r1.power"], to=["c1"], table=True)
    power = g["of"]["table.r1.power"]
    assert power["value"] == pytest.approx(table["r1"]["power"], rel=1e-9)
    assert power["to"]["c1"] * 1e-6 == pytest.approx(power["value"] - 1e-3 * math.exp(-10) , rel=1e-6)


def test_a_table_has_losses_and_tells_of_a_runaway():
    text = """commutation
v1 a 0 400
s1 a b g 0 sm
d1 0 b dm
i1 b 0 10
vg g 0 pulse(0 5 0 0 0 4u 10u)
.model sm sw(ideal vt=2.5 rthjc=0.2 vloss=400 iloss=10 tloss=[25 125] eon=[1u {hot}])
.model dm d(ideal vloss=400 iloss=10 err=2u)
.tran 1u 1m
.save v(b)
"""
    table = circ.parse(text.replace("{hot}", "1.5u")).table(steady=True)
    losses = table["s1"]["losses"]
    warm = 27 + 0.2 * 0.1 * (1 + 0.005 * 2) / (1 - 0.2 * 0.0005)
    assert losses["on"]["count"] == 1 and abs(losses["temperature"] - warm) < 1e-9
    assert abs(table["power"]["switching"] - losses["switching"] - 0.2) < 1e-12
    table = circ.parse(text.replace("{hot}", "1")).table(steady=True)
    assert table["s1"]["losses"]["temperature"] is None
    assert any("thermal runaway" in note for note in table["part"]["notes"])


def test_steady_state():
    p = circ.parse(BUCK).pss()
    assert p.pss["stable"] and p.pss["period"] == pytest.approx(10e-6)
    assert p.time[-1] == pytest.approx(10e-6)
    assert p["v(out)"].mean() == pytest.approx(0.4 * 12, rel=2e-3)


def test_small_signals():
    m = circ.parse("rc\nv1 1 0 dc 2 ac 1\nr1 1 2 1k\nc1 2 0 1u\n.end\n")
    a = m.ac([100.0, 1 / (2e-3 * math.pi)])
    assert a["v(2)"][1] == pytest.approx(0.5 - 0.5j, abs=1e-12)
    assert a.frequency[0] == 100.0
    with pytest.raises(KeyError):
        a["v(9)"]


def test_a_controller_in_the_loop():
    m = circ.parse(BUCK)
    s = m.simulation()
    start = s.checkpoint()
    assert s.time == 0.0 and sorted(s.state_names) == ["i(l1)", "v(c1)"]
    stop = s.advance(5e-6)
    assert stop.time == 5e-6 and stop.reason == "time" and len(stop.events) >= 1
    event = s.advance(1e-3, to_event=True)
    assert event.reason == "event" and event.events[-1]["t"] == event.time
    before = s["v(out)"]
    s.set_switch("s1", True)
    s.set_source("vi", 24.0)
    s.advance(event.time + 5e-6)
    assert s["v(out)"] > before
    s.restore(start)
    assert s.time == 0.0 and np.all(s.state == 0.0)
    with pytest.raises(KeyError):
        s["v(nowhere)"]
    with pytest.raises(KeyError):
        s.set_switch("s9", True)
    with pytest.raises(circ.SimulationError):
        s.set_source("vi", math.nan)


def test_threads_give_the_same_bytes_as_one_by_one():
    values = [0.2 + 0.01 * k for k in range(24)]

    def run(d):
        m = circ.parse(BUCK, params={"d": d})
        return m.tran()["v(out)"].tobytes()

    one_by_one = [run(d) for d in values]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(run, values)) == one_by_one


def test_sweeps_are_datasets_with_failures_as_entries():
    pytest.importorskip("xarray")
    m = circ.parse(BUCK)
    d = circ.sweep(m, {"d": [0.2, 0.4, 0.6], "r1": [3.0, 6.0]}, measures=["vout"])
    assert d["vout"].dims == ("d", "r1") and d["vout"].shape == (3, 2)
    assert float(d["vout"].sel(d=0.4, r1=3.0)) == pytest.approx(4.8, rel=0.1)
    broken = circ.sweep(m, {"r1": [3.0, float("nan")]}, measures=["vout"])
    assert broken["error"].values[0] == "" and broken["error"].values[1] != "" and np.isnan(broken["vout"].values[1])
    with pytest.raises(KeyError, match="no `.meas` `nothing`"):
        circ.sweep(m, {"r1": [3.0]}, measures=["nothing"])
    with pytest.raises(KeyError, match="no element or parameter `r7`"):
        circ.sweep(m, {"r7": [3.0]}, measures=["vout"])
    told = []
    none_named = circ.sweep(m, {"r1": [3.0, 4.0]}, measures=[], progress=lambda done, total: told.append((done, total)))
    assert set(none_named) == {*m.tran().measures, "error"} and told[-1] == (2, 2)
    with pytest.raises(ValueError, match="engine"):
        circ.sweep(m, {"r1": [3.0]}, measures=["vout"], engine="cloud")


@pytest.mark.skipif(not os.path.exists("/proc/self/task") or len(os.sched_getaffinity(0)) < 2, reason="counts the threads of Linux that worked")
def test_sweeps_use_more_than_one_thread():
    pytest.importorskip("xarray")

    def worked():
        """By thread: its time in the user's code, in ticks of 10 ms."""
        return {task: int(open(f"/proc/self/task/{task}/stat").read().rpartition(")")[2].split()[11]) for task in os.listdir("/proc/self/task")}

    before = worked()
    circ.sweep(circ.parse(BUCK), {"r1": np.linspace(3, 6, 1000)}, measures=["vout"])
    long = [task for task, ticks in worked().items() if ticks > before.get(task, 0) + 5]
    assert len([task for task in long if int(task) != os.getpid()]) >= 2


def test_samples_depend_on_seed_and_number_alone():
    pytest.importorskip("xarray")
    m = circ.parse(FILTER)
    tolerances = {"c1": circ.normal(rel=0.05), "r1": circ.uniform(rel=0.1)}
    few = circ.monte_carlo(m, tolerances, n=5, seed=1, measures=["last"])
    many = circ.monte_carlo(m, tolerances, n=40, seed=1, measures=["last"])
    assert np.array_equal(few["last"], many["last"][:5])
    alone = m.copy()
    for name in ("c1", "r1"):
        alone.set(name, float(many[f"value of {name}"][17]))
    assert alone.tran().measures["last"] == float(many["last"][17])
    with pytest.raises(ValueError, match="a tolerance of -1"):
        circ.monte_carlo(m, {"r1": circ.normal(rel=-1.0)}, n=2, seed=1, measures=["last"])
    about = circ.monte_carlo(m, tolerances, n=5, seed=1, measures=["last"], nominal={"r1": 2e3})
    assert np.allclose(about["value of r1"], 2 * few["value of r1"], rtol=1e-15) and np.array_equal(about["value of c1"], few["value of c1"])
    r, c = many["value of r1"], many["value of c1"]
    assert np.allclose(many["last"], 1 - np.exp(-5e-3 / (r * c)), atol=1e-12)
    assert np.all(np.abs(r / 1e3 - 1) <= 0.1) and not np.array_equal(circ.monte_carlo(m, tolerances, n=5, seed=2, measures=["last"])["last"], few["last"])


def test_conversions():
    w = circ.parse(FILTER).tran()
    x = pytest.importorskip("xarray") and w.to_xarray()
    assert x["v(out)"].attrs["units"] == "V" and x["time"].shape == (51,)
    p = pytest.importorskip("pandas") and w.to_pandas()
    assert p["v(out)"].iloc[-1] == w["v(out)"][-1]


LINEAR = """band pass with a blocking diode
vin in 0 dc 1 ac 1
l1 in a 1m
c1 a out 1u
r1 out 0 10
c2 out 0 10u
d1 0 out ideal
.model ideal d(ideal)
.tran 1u 1m
.save v(out)
.end
"""


def test_systems_and_responses_go_to_scipy_and_python_control():
    signal, control = pytest.importorskip("scipy.signal"), pytest.importorskip("control")
    m = circ.parse(LINEAR)
    l = m.lcs()
    assert [(port["lambda"], port["y"]) for port in l.ports] == [("i(d1)", "-v(d1)")]
    f = np.array([1e2, 5e3, 1e5])
    w = 2 * np.pi * f
    # While the diode blocks, λ = 0 and y = −v(d1) = v(out): a band pass.
    s = 1j * w
    load = 1 / (1 / 10 + s * 10e-6)
    expected = load / (load + s * 1e-3 + 1 / (s * 1e-6))
    ours = m.ac(f)
    assert np.allclose(ours["v(out)"], expected, rtol=1e-9)
    scipy_side = l.to_scipy()
    direct = [scipy_side.C @ np.linalg.solve(x * np.eye(3) - scipy_side.A, scipy_side.B) + scipy_side.D for x in s]
    assert np.allclose([h[0, 1] for h in direct], expected, rtol=1e-9)
    _, out, _ = signal.lsim(scipy_side, np.column_stack([np.zeros(2001), np.ones(2001)]), np.linspace(0, 1e-3, 2001))
    assert np.isfinite(out).all()
    system = l.to_control()
    assert system.input_labels == ["i(d1)", "vin"] and system.output_labels == ["-v(d1)"] and system.state_labels == [x["name"] for x in l.states]
    assert np.allclose(system(s[1])[0, 1], expected[1], rtol=1e-9)
    data = ours.to_control("v(out)")
    assert np.allclose(data.omega, w) and np.allclose(data(1j * w[1]), expected[1], rtol=1e-6)


def test_ctrl_c_ends_a_long_run():
    m = circ.parse(BUCK)
    # A shell that starts a job in the background lets it ignore the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            m.tran(stop=1000.0, step=1.0)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def test_memory_does_not_grow():
    resource = pytest.importorskip("resource")
    m = circ.parse(FILTER)
    for _ in range(200):
        m.tran()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(int(os.environ.get("CIRC_PYTHON_RUNS", "2000"))):
        m.tran()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000


def test_a_cluster_gives_the_bytes_of_threads_though_a_worker_is_killed(monkeypatch):
    distributed = pytest.importorskip("distributed")
    pytest.importorskip("xarray")
    m = circ.parse(BUCK.replace(".tran 1u 2m", ".tran 10u 20m"))
    values = {"r1": [2.0 + 0.005 * k for k in range(100)]}
    here = circ.sweep(m, values, ["vout"])
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        victims = list(client.run(os.getpid).values())[:1]

        def kill_once(done, total):
            if victims and done < total:
                os.kill(victims.pop(), signal.SIGKILL)

        there = circ.sweep(m, values, ["vout"], engine="dask", client=client, progress=kill_once)
        # A chunk that fails however often it is tried is lost, and the rest is kept.
        whole = _sweep._timed

        def lost(packed, question, points):
            if any(values == [2.1] for values, _ in points):
                raise OSError("no room")
            return whole(packed, question, points)

        monkeypatch.setattr(_sweep, "_timed", lost)
        partly = circ.sweep(m, values, ["vout"], engine="dask", client=client)
    assert not victims
    assert there["vout"].values.tobytes() == here["vout"].values.tobytes()
    missing = np.isnan(partly["vout"].values)
    assert missing[20] and missing.sum() <= 16 and all("no room" in error for error in partly["error"].values[missing])
    assert np.array_equal(partly["vout"].values[~missing], here["vout"].values[~missing])
    with pytest.raises(ValueError, match="client"):
        circ.sweep(m, values, ["vout"], engine="dask")
