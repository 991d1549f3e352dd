"""spicelib, which many scripts around LTspice and ngspice use, calls `circ` in ngspice's place."""

import math
import os
import pathlib

import pytest

spicelib = pytest.importorskip("spicelib")
from spicelib.log.ltsteps import LTSpiceLogReader
from spicelib.simulators.ngspice_simulator import NGspiceSimulator

ROOT = pathlib.Path(__file__).resolve().parents[2]
CIRC = pathlib.Path(os.environ.get("CIRC", ROOT / "target/debug/circ"))
NETLIST = """* charging
V1 in 0 1
R1 in out {r}
C1 out 0 1u
.param r=1k
%s
.tran 10u 5m uic
.meas tran last find v(out) at=4m
.meas tran mean avg v(out) from=0 to=4m
.meas tran never when v(out)=2
.four 1k v(out)
.end
"""

pytestmark = pytest.mark.skipif(not CIRC.exists(), reason="no circ is built: name one by CIRC")


def runs(tmp_path, step, capacitances):
    """(capacitance, raw file, log) of each run of spicelib's own sweep."""
    (tmp_path / "rc.cir").write_text(NETLIST % step)
    runner = spicelib.SimRunner(output_folder=str(tmp_path / "out"), simulator=NGspiceSimulator.create_from(str(CIRC)), parallel_sims=2)
    net = spicelib.SpiceEditor(str(tmp_path / "rc.cir"))
    tasks = []
    for c in capacitances:
        net.set_component_value("C1", c)
        tasks.append((c, runner.run(net, run_filename=f"rc_{c}.cir")))
    assert runner.wait_completion()
    return [(c, spicelib.RawRead(str(task.raw_file), dialect="ngspice"), LTSpiceLogReader(str(task.log_file))) for c, task in tasks]


def test_a_sweep_of_spicelib(tmp_path):
    for c, raw, log in runs(tmp_path, "", [1e-6, 2e-6, 3e-6]):
        tau = 1e3 * c
        time, out = raw.get_wave("time"), raw.get_wave("v(out)")
        assert len(time) == 501
        assert out == pytest.approx([1 - math.exp(-t / tau) for t in time], abs=1e-12)
        found = {name: value for name, (value,) in log.dataset.items()}
        assert found["last"] == pytest.approx(1 - math.exp(-4e-3 / tau), abs=1e-12) and found["last_at"] == 4e-3
        assert found["mean"] == pytest.approx(1 - tau / 4e-3 * (1 - math.exp(-4e-3 / tau)), abs=1e-4)
        assert (found["mean_from"], found["mean_to"]) == (0, 4e-3) and "never" not in found
        (fourier,) = log.fourier["v(out)"]
        assert fourier.dc_component == pytest.approx(out[-101:].mean(), abs=1e-3) and len(fourier) == 9


def test_steps_of_the_netlist(tmp_path):
    ((_, _, log),) = runs(tmp_path, ".step param r list 1k 2k 4k", [1e-6])
    assert log.stepset == {"r": [1e3, 2e3, 4e3]}
    assert log.dataset["last"] == pytest.approx([1 - math.exp(-4e-3 / (r * 1e-6)) for r in (1e3, 2e3, 4e3)], abs=1e-12)
    assert len(log.fourier["v(out)"]) == 3


def test_a_fault_is_in_the_log(tmp_path):
    (tmp_path / "bad.cir").write_text("* bad\nR1 a b c d\n.tran 1u 1m\n.end\n")
    runner = spicelib.SimRunner(output_folder=str(tmp_path / "out"), simulator=NGspiceSimulator.create_from(str(CIRC)))
    task = runner.run(str(tmp_path / "bad.cir"))
    runner.wait_completion()
    assert task.retcode != 0 and "neither a model" in pathlib.Path(task.log_file or tmp_path / "out/bad_1.log").read_text()
