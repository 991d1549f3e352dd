"""The programs in the README and in docs/python.md, as they stand there, one after the other."""

import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUCK = """buck
.param d=0.4
vin in 0 24 ac 1
vg g 0 pulse(0 1 0 0 0 {d*10u} 10u)
s1 in sw g 0 sw
d1 0 sw ideal
l1 sw out 47u
c1 out 0 100u
r1 out 0 10
.model sw sw(ideal vt=0.5)
.model ideal d(ideal)
.tran 1u 2m
.save v(out) i(l1)
.meas tran vout avg v(out) from=1m
.end
"""


@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_every_program_runs(page, tmp_path, monkeypatch):
    for module in ("xarray", "pandas", "matplotlib"):
        pytest.importorskip(module)
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "netlists").mkdir()
    for place in ("buck.cir", "netlists/buck.cir"):
        (tmp_path / place).write_text(BUCK)
    programs = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), flags=re.DOTALL | re.MULTILINE)
    assert programs
    names = {}
    for program in programs:
        exec(compile(program, page, "exec"), names)
