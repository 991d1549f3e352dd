//! Examples below the help of every command.

pub(super) const CIRC: &str = "\
Examples:
  circ buck.cir                     simulate; a plot on a terminal, CSV into a pipe
  circ buck.cir --open              results as a page in the browser
  circ buck.cir -o buck.html        results as a page; csv, raw, npz, json, svg, png by the ending
  circ check buck.cir               what is known before it runs
  circ explain unknown-model        what a message means

Exit status: 0 done; 1 the answer is no (outside tolerance, faults found); 2 it could not be done; 128 + n ended by signal n.";

pub(super) const SIM: &str = "\
Examples:
  circ sim buck.cir -o buck.csv -o buck.svg
  circ sim buck.cir --probe 'v(out)' --probe 'i(l1)' --param duty=0.4
  circ sim buck.cir --verify --table";

pub(super) const PSS: &str = "\
Examples:
  circ pss buck.cir -o period.csv --summary text
  circ pss buck.cir --table --in v1 --out r1";

pub(super) const AC: &str = "\
Examples:
  circ ac filter.cir -o bode.svg
  circ ac loop.cir --probe '-v(y)/v(x)' -o bode.html";

pub(super) const SENS: &str = "\
Examples:
  circ sens buck.cir --of vout_avg --to l1 --to r1
  circ sens buck.cir --pss --json";

pub(super) const SWEEP: &str = "\
Examples:
  circ sweep buck.cir --param d=0.3,0.5,0.7 --param l1=log:10u:1m:20
  circ sweep buck.cir --mc 1000 --tol-of l1=10% --sigma-of r1=1% -o samples.csv
  circ sim buck.cir --sample 17 --tol-of l1=10% --sigma-of r1=1%   one of these samples alone";

pub(super) const LCS: &str = "\
Examples:
  circ lcs buck.cir
  circ lcs buck.cir --format numpy -o buck.py --switch s1=on
  circ lcs buck.cir --format json -o buck.json && circ sim buck.json";

pub(super) const CHECK: &str = "\
Examples:
  circ check buck.cir
  circ check buck.cir --json";

pub(super) const OP: &str = "\
Examples:
  circ op buck.cir
  circ op buck.cir --param vin=24 --json";

pub(super) const BENCH: &str = "\
Examples:
  circ bench buck.cir -o buck.csv -o buck.svg
  circ bench buck.cir --against ngspice --methods exact,ngspice";

pub(super) const COMPARE: &str = "\
Examples:
  circ compare buck.cir
  circ compare buck.cir --against measured.csv --tol 1e-3 -o difference.svg";

pub(super) const GRAPH: &str = "\
Examples:
  circ graph buck.cir -o buck.svg
  circ graph buck.cir --at 1.2m -o buck.png
  circ graph buck.cir | dot -Tpdf > buck.pdf";

pub(super) const VIEW: &str = "\
Examples:
  circ view buck.raw
  circ view buck.raw --probe 'v(out)' --probe 'i(l*)' -o buck.html";

pub(super) const WATCH: &str = "\
Examples:
  circ watch buck.cir
  circ watch buck.cir --probe 'v(out)' --tol 1e-6
  circ watch ac filter.cir";

pub(super) const EXPLAIN: &str = "\
Examples:
  circ explain
  circ explain unknown-model";

pub(super) const COMPLETIONS: &str = "\
Examples:
  circ completions bash > ~/.local/share/bash-completion/completions/circ
  circ completions zsh > ~/.zfunc/_circ
  circ completions fish > ~/.config/fish/completions/circ.fish";

pub(super) const MAN: &str = "\
Examples:
  circ man ~/.local/share/man/man1
  circ man | man -l -";
