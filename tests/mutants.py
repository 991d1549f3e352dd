#!/usr/bin/env python3
"""Mutation testing of the rooms that compute: which changes of the code no test notices. Writes docs/mutation.md.

    python3 -m venv target/venv && target/venv/bin/pip install tree-sitter tree-sitter-rust
    target/venv/bin/python tests/mutants.py [--seed S] [--count N] [--budget SECONDS] [--fresh]

The sources are copied to target/mutants/tree, and in the copy every mutated place becomes `if crate::mutant(K) { mutated } else { original }`:
one build serves all mutants, and the environment chooses one. Places are drawn by the seed, equally many of each kind in proportion to the
code; those that do not compile are replaced. A second list, of places that an audit by hand found unguarded, stands in tests/mutants.toml
with the explanation of every survivor.

Each test runs once in a process of its own as the code stands, which tells its time and the mutants it reaches; then each mutant meets the
tests that reach it, those first that are short or have killed many, until one fails or hangs, or until their times sum to the budget. Verdicts
stay in target/mutants/results.json: a later run asks of what survived only the tests that it has not passed yet, by their names. `--fresh`
forgets the verdicts, which a change of the code wants.
"""

import argparse
import collections
import hashlib
import json
import math
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib

try:
    import tree_sitter
    import tree_sitter_rust
except ImportError:
    sys.exit("wanted: the Python packages tree-sitter and tree-sitter-rust (pip install tree-sitter tree-sitter-rust)")

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "mutants"
TREE = WORK / "tree"
LIST = "tests/mutants.toml"
PAGE = ROOT / "docs" / "mutation.md"
# The rooms that decide numbers, and what in them reads and writes files.
ROOMS = """algebra linalg law measure mna lcs solve integrate analysis passivity check circuit/source""".split()
UNCOUNTED = re.compile(r"lcs/(json/|format|sparse_format|siconos)|check/(text|facts)")
# A test hangs after so many times its time, and so many seconds.
HANGS = (10, 10.0)
# What a test may take of memory, bytes: a mutant may ask for all there is.
MEMORY = 8 << 30

SWAPS = {
    "arithmetic": {"+": "-", "-": "+", "*": "/", "/": "*"},
    "boundary": {"<": "<=", "<=": "<", ">": ">=", ">=": ">"},
    "logic": {"==": "!=", "!=": "==", "&&": "||", "||": "&&"},
    "assignment": {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*="},
}
KINDS = {
    "arithmetic": "`+` and `-`, `*` and `/` exchanged",
    "assignment": "the same of `+=`, `-=`, `*=`, `/=`",
    "boundary": "`<` and `<=`, `>` and `>=` exchanged",
    "logic": "`==` and `!=`, `&&` and `\\|\\|` exchanged",
    "condition": "the condition of an `if` negated",
    "sign": "a minus dropped",
    "abs": "`.abs()` dropped",
    "extreme": "`min` and `max` exchanged",
    "number": "a number doubled, 0 made 1",
    "return": "an early `return`, `continue` or `break` left out",
    "call": "a call whose result is not used left out",
}
RUNTIME = """
/// Whether mutant `number` is the one that the environment chooses; where it asks for a trace, notes that this place was reached.
#[doc(hidden)]
#[inline]
pub fn mutant(number: usize) -> bool {
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
    static CHOSEN: LazyLock<usize> =
        LazyLock::new(|| std::env::var("CIRC_MUTANT").map_or(usize::MAX, |n| n.parse().unwrap_or(usize::MAX)));
    static TRACE: LazyLock<Option<String>> = LazyLock::new(|| std::env::var("CIRC_MUTANT_TRACE").ok());
    static REACHED: [AtomicBool; COUNT] = [const { AtomicBool::new(false) }; COUNT];
    if let Some(folder) = &*TRACE
        && !REACHED[number].load(Relaxed)
        && !REACHED[number].swap(true, Relaxed)
    {
        use std::io::Write;
        let path = format!("{folder}/{}", std::process::id());
        if let Ok(mut file) = std::fs::OpenOptions::new().create(true).append(true).open(path) {
            let _ = writeln!(file, "{number}");
        }
    }
    *CHOSEN == number
}
"""


# ---------------------------------------------------------------- places

Mutant = collections.namedtuple("Mutant", "file function kind start end source mutated nth statement")


def key(mutant):
    """What names a mutant while other code moves."""
    return named_by(mutant.file, mutant.function, mutant.source, mutant.mutated, mutant.nth)


def named_by(*parts):
    """What stands in the results and in the list for such a name."""
    return " ".join(" | ".join(str(part) for part in parts).split())


def is_test(item):
    """Whether an attribute `#[cfg(test)]` stands before an item."""
    before = item.prev_named_sibling
    while before is not None and before.type in ("attribute_item", "line_comment"):
        if b"cfg(test)" in before.text:
            return True
        before = before.prev_named_sibling
    return False


def changes(node):
    """The mutations of one node: kind, what replaces its text, whether it is a statement."""
    text = node.text.decode()

    def spliced(part, new):
        start, end = part.start_byte - node.start_byte, part.end_byte - node.start_byte
        return (node.text[:start] + new.encode() + node.text[end:]).decode()

    if node.type in ("binary_expression", "compound_assignment_expr"):
        operator = node.child_by_field_name("operator")
        for kind, swaps in SWAPS.items():
            if operator.type in swaps:
                yield kind, spliced(operator, swaps[operator.type]), False
    elif node.type == "unary_expression" and node.children[0].type == "-":
        yield "sign", node.children[1].text.decode(), False
    elif node.type == "float_literal":
        yield "number", "1.0" if float(re.sub("_|f64", "", text)) == 0 else f"(2.0 * {text})", False
    elif node.type == "if_expression":
        condition = node.child_by_field_name("condition")
        if condition.type not in ("let_condition", "let_chain"):
            yield "condition", f"!({condition.text.decode()})", False
    elif node.type == "call_expression" and node.child_by_field_name("function").type == "field_expression":
        function = node.child_by_field_name("function")
        name = function.child_by_field_name("field")
        if name.text in (b"min", b"max"):
            yield "extreme", spliced(name, {b"min": "max", b"max": "min"}[name.text]), False
        elif name.text == b"abs":
            yield "abs", function.child_by_field_name("value").text.decode(), False
    elif node.type == "expression_statement":
        inner = node.named_children[0]
        if inner.type == "call_expression" and text.endswith(";"):
            yield "call", "", True
        leaves = inner.type in ("return_expression", "continue_expression", "break_expression")
        around = node.parent.parent
        if leaves and around.type == "if_expression" and around.child_by_field_name("alternative") is None:
            yield "return", "", True


def places(file, text):
    """All mutants of a file, outside constants, patterns, macros and tests, and the modules that are tests."""
    found, tests, counts = [], [], collections.Counter()
    parser = tree_sitter.Parser(tree_sitter.Language(tree_sitter_rust.language()))

    def walk(node, function):
        if node.type in ("const_item", "static_item", "macro_invocation", "macro_definition", "attribute_item", "array_type"):
            return
        if node.type.endswith("_pattern") or node.type in ("range_pattern", "enum_variant", "const_block"):
            return
        if node.type.endswith("_item") and is_test(node):
            if node.type == "mod_item" and node.child_by_field_name("body") is None:
                tests.append(node.child_by_field_name("name").text.decode())
            return
        if node.type == "function_item":
            if any(c.type == "function_modifiers" and b"const" in c.text for c in node.children):
                return
            function = node.child_by_field_name("name").text.decode()
        for kind, mutated, statement in changes(node):
            where = node.child_by_field_name("condition") if kind == "condition" else node
            source = where.text.decode()
            nth = counts[function, source, mutated]
            counts[function, source, mutated] += 1
            found.append(Mutant(file, function, kind, where.start_byte, where.end_byte, source, mutated, nth, statement))
        for child in node.children:
            walk(child, function)

    walk(parser.parse(text).root_node, "")
    return found, tests


def listed(entry, text):
    """The mutant of an entry of the list: its text stands in the file as often as `nth` says, or once."""
    source, nth = entry["from"].strip(), entry.get("nth", 0)
    at = [found.start() for found in re.finditer(re.escape(source.encode()), text)]
    if len(at) <= nth:
        sys.exit(f"{LIST}: {entry['id']}: {entry['file']} has no {source!r}")
    start, statement = at[nth], source.endswith(";")
    mutated = entry["to"].strip()
    return Mutant(entry["file"], str(entry["id"]), "listed", start, start + len(source.encode()), source, mutated, nth, statement)


def candidates():
    """Every mutant of the rooms."""
    files = {}
    excluded = set()
    for room in ROOMS:
        for path in sorted([*(ROOT / "src" / room).rglob("*.rs"), *(ROOT / "src").glob(f"{room}.rs")]):
            file = path.relative_to(ROOT).as_posix()
            if not UNCOUNTED.search(file):
                files[file], tests = places(file, path.read_bytes())
                folder = path.parent if path.name == "mod.rs" else path.with_suffix("")
                excluded |= {(folder / name).relative_to(ROOT).as_posix() for name in tests}
    inside = lambda file: any(file == f"{e}.rs" or file.startswith(f"{e}/") for e in excluded)
    return [mutant for file, found in files.items() if not inside(file) for mutant in found]


def drawn(mutants, seed):
    """The mutants in the order of the draw, in which all kinds are equally likely: where one stands depends on the seed and its own text."""
    counts = collections.Counter(mutant.kind for mutant in mutants)

    def rank(mutant):
        text = " | ".join(str(part) for part in (mutant.file, mutant.function, mutant.source, mutant.mutated, mutant.nth))
        digest = hashlib.sha256(f"{seed} {text}".encode()).digest()
        uniform = (int.from_bytes(digest[:7]) + 1) / 2**56
        return -math.log(uniform) * counts[mutant.kind]

    return sorted(mutants, key=rank)


# ---------------------------------------------------------------- the copy


def rewritten(text, numbered):
    """The text with its mutants, (number, mutant) each, and where each stands in it."""
    numbered = sorted(numbered, key=lambda pair: (pair[1].start, -pair[1].end, pair[0]))
    out, where = bytearray(), []

    def copy(start, end, inner):
        while inner:
            number, mutant = inner[0]
            nested = [pair for pair in inner[1:] if pair[1].start < mutant.end]
            inner = inner[1 + len(nested) :]
            out.extend(text[start : mutant.start])
            begin = len(out)
            bracket = (b"", b"") if mutant.statement else (b"(", b")")
            out.extend(bracket[0] + f"if crate::mutant({number}) {{ {mutant.mutated} }} else {{ ".encode())
            copy(mutant.start, mutant.end, nested)
            out.extend(b" }" + bracket[1])
            where.append((begin, len(out), number))
            start = mutant.end
        out.extend(text[start:end])

    copy(0, len(text), numbered)
    return bytes(out), where


def write(path, content):
    """Writes what is not there yet, so that cargo builds nothing twice."""
    if not path.is_file() or path.read_bytes() != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def copy_tree(mutants):
    """Copies the repository with its mutants; failing cases of random tests are not kept there, where other mutants would meet them."""
    names = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, capture_output=True, check=True)
    by_file, where = collections.defaultdict(list), {}
    for number, mutant in enumerate(mutants):
        by_file[mutant.file].append((number, mutant))
    wanted = {name for name in names.stdout.decode().split("\0") if name and (ROOT / name).is_file()}
    for name in wanted:
        content = (ROOT / name).read_bytes()
        if name in by_file:
            content, where[name] = rewritten(content, by_file[name])
        if name.endswith(".rs"):
            content = re.sub(rb"FileFailurePersistence::\w+\([^)]*\)", b"FileFailurePersistence::Off", content)
        if name == "src/lib.rs":
            content += RUNTIME.replace("COUNT", str(len(mutants))).encode()
        write(TREE / name, content)
    for path in (TREE / "src").rglob("*"), (TREE / "tests").rglob("*"):
        for file in path:
            if file.is_file() and file.relative_to(TREE).as_posix() not in wanted:
                file.unlink()
    return where


def cargo(*arguments):
    """The JSON messages of cargo on the copy."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(WORK / "build"), "CARGO_INCREMENTAL": "0"}
    command = ["cargo", *arguments, "--locked", "--message-format", "json"]
    ran = subprocess.run(command, cwd=TREE, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return ran, [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]


def compiled(fixed, order, count, known):
    """The copy with all fixed mutants and the first `count` of the order that compile; `known` keeps those that do not."""
    while True:
        mutants = fixed + [mutant for mutant in order if key(mutant) not in known][:count]
        where = copy_tree(mutants)
        ran, messages = cargo("check", "--lib")
        if ran.returncode == 0:
            return mutants
        wrong = set()
        for message in messages:
            if message["reason"] == "compiler-message" and message["message"]["level"] == "error":
                for span in message["message"]["spans"]:
                    around = [w for w in where.get(span["file_name"], []) if w[0] <= span["byte_start"] and span["byte_end"] <= w[1]]
                    wrong |= {min(around, key=lambda w: w[1] - w[0])[2]} if around else set()
        if not wrong:
            sys.exit(ran.stderr[-5000:] + "the copy does not compile, and no mutant is where it says so")
        for number in wrong:
            if number < len(fixed):
                sys.exit(f"{LIST}: mutant {fixed[number].function} does not compile")
            known.append(key(mutants[number]))
        print(f"{len(wrong)} mutants do not compile", flush=True)


# ---------------------------------------------------------------- tests


def run(binary, name, seconds, environment):
    """Whether a test passes, within its time."""
    command = [binary, "--exact", name, "--test-threads", "1"]
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    settings = {"PROPTEST_RNG_SEED": "20261122", "PROPTEST_MAX_SHRINK_ITERS": "0", "INSTA_UPDATE": "no"}
    settings |= {"INSTA_WORKSPACE_ROOT": str(TREE), "CARGO_MANIFEST_DIR": str(TREE), "RUST_BACKTRACE": "0"}
    process = subprocess.Popen(
        command,
        cwd=TREE,
        env=os.environ | settings | environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=limit,
    )
    try:
        return process.wait(seconds) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()


def built():
    """The executables with tests, by the name of their target."""
    ran, messages = cargo("test", "--no-run")
    if ran.returncode != 0:
        sys.exit(ran.stderr[-5000:])
    artifacts = [m for m in messages if m["reason"] == "compiler-artifact" and m["executable"] and m["profile"]["test"]]
    return {f"{m['target']['kind'][0]} {m['target']['name']}": m["executable"] for m in artifacts}


def traced(binaries, mutants, traces):
    """Each test by its name: its executable, time and the mutants that it reaches; None where it fails as the code stands."""
    tests = {}
    keys = [key(mutant) for mutant in mutants]
    for target, binary in binaries.items():
        names = subprocess.run([binary, "--list", "--format", "terse"], cwd=TREE, capture_output=True, text=True, check=True)
        for line in names.stdout.splitlines():
            if line.endswith(": test"):
                tests[f"{target} {line.removesuffix(': test')}"] = (binary, line.removesuffix(": test"))
    if traces.get("keys") != keys:
        traces.clear()
        traces |= {"keys": keys, "tests": {}}
    for test, (binary, name) in tests.items():
        if test not in traces["tests"]:
            with tempfile.TemporaryDirectory() as folder:
                began = time.monotonic()
                passes = run(binary, name, 1200, {"CIRC_MUTANT_TRACE": folder})
                took = time.monotonic() - began
                reached = {int(n) for file in pathlib.Path(folder).iterdir() for n in file.read_text().split()}
            traces["tests"][test] = {"seconds": took, "reached": sorted(reached), "passes": passes}
    return {test: (*run, traces["tests"][test]) for test, run in tests.items()}


def judged(number, tests, before, kills, budget):
    """The verdict on one mutant. A test that fails is run again, so that one that sometimes fails by itself kills nothing."""
    reaching = [(trace["seconds"], test) for test, (_, _, trace) in tests.items() if trace["passes"] and number in trace["reached"]]
    passed = [test for _, test in sorted(reaching) if test in before.get("passed", [])]
    spent = 0.0
    for seconds, test in sorted(reaching, key=lambda pair: (pair[0] / (1 + kills[pair[1]]), pair)):
        if test in passed:
            continue
        if spent + seconds > budget:
            break
        spent += seconds
        binary, name, _ = tests[test]
        once = lambda: run(binary, name, HANGS[0] * seconds + HANGS[1], {"CIRC_MUTANT": str(number)})
        if not once() and not once():
            return {"verdict": "killed", "by": test}
        passed.append(test)
    verdict = "survived" if reaching else "not reached"
    return {"verdict": verdict, "passed": passed, "reaching": len(reaching)}


# ---------------------------------------------------------------- the page


def code(text):
    """Text of the sources in a cell of a table."""
    text = " ".join(text.split())
    text = text if len(text) < 90 else text[:87] + "..."
    return "`" + text.replace("|", "\\|") + "`" if text else "nothing"


def named(test):
    """The words for a test: its file and name."""
    kind, target, name = test.split(" ", 2)
    return f"`{name}`" if kind == "lib" else f"`tests/{target}`: `{name}`"


def room(file):
    """The room of a file."""
    return "circuit::source" if file.startswith("src/circuit") else file.split("/")[1].removesuffix(".rs")


def table(head, rows):
    """A table in Markdown."""
    lines = [" | ".join(str(cell) for cell in row) for row in [head, *rows]]
    lines.insert(1, " | ".join("---" for _ in head))
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def tallied(group, mutants, results, explained):
    """Rows of counts: mutants, killed, equivalent, survivors."""
    counts = collections.defaultdict(collections.Counter)
    for mutant in mutants:
        verdict = results[key(mutant)]["verdict"]
        if verdict != "killed" and explained.get(key(mutant), {}).get("equivalent"):
            verdict = "equivalent"
        counts[group(mutant)]["killed" if verdict == "killed" else "equivalent" if verdict == "equivalent" else "survived"] += 1
    total = sum(counts.values(), collections.Counter())
    row = lambda name, c: [name, sum(c.values()), c["killed"], c["equivalent"], c["survived"]]
    return [row(name, c) for name, c in sorted(counts.items())] + [row("all", total)], total


def page(arguments, entries, mutants, results, tests, explained):
    """Writes docs/mutation.md; returns the survivors that nothing explains."""
    run_ones = [mutant for mutant in mutants if key(mutant) in results]
    random_ones = [mutant for mutant in run_ones if mutant.kind != "listed"]
    by_id = {mutant.function: mutant for mutant in run_ones if mutant.kind == "listed"}
    head = ["", "mutants", "killed", "equivalent", "survived"]
    rooms, total = tallied(lambda m: f"`{room(m.file)}`", random_ones, results, explained)
    kinds, _ = tallied(lambda m: KINDS[m.kind], random_ones, results, explained)
    failing = sorted(test for test, (_, _, trace) in tests.items() if not trace["passes"])
    share = 100 * total["survived"] / max(1, total.total())
    by_hand = []
    for entry in entries:
        mutant = by_id.get(str(entry["id"]))
        if mutant is None:
            by_hand.append([entry["id"], entry["what"], "gone" if "gone" in entry else "not run", entry.get("gone", "")])
            continue
        result = results[key(mutant)]
        killed = result["verdict"] == "killed"
        verdict = "killed" if killed else "equivalent" if entry.get("equivalent") else result["verdict"]
        by_hand.append([entry["id"], entry["what"], verdict, named(result["by"]) if killed else entry.get("why", "")])
    survivors, open_ones = [], []
    for mutant in random_ones:
        result = results[key(mutant)]
        if result["verdict"] == "killed":
            continue
        entry = explained.get(key(mutant))
        open_ones += [] if entry else [mutant]
        where = f"`{mutant.file.removeprefix('src/')}`, `{mutant.function}`: {code(mutant.source)} → {code(mutant.mutated)}"
        tried = f"{len(result['passed'])} of {result['reaching']}"
        verdict = "equivalent" if entry and entry.get("equivalent") else result["verdict"]
        survivors.append([where, verdict, tried, entry["why"] if entry else "*unexplained*"])
    hand = collections.Counter(row[2] for row in by_hand)
    PAGE.write_text(f"""# Mutation testing

Which changes of the code no test notices. `tests/mutants.py` draws places of the rooms that compute, changes one at a time, and runs the
tests that reach it until one fails; its head says how, and what it needs. This page is what

```text
python3 tests/mutants.py --seed {arguments.seed} --count {arguments.count}
```

wrote, with its explanations from `tests/mutants.toml`. A mutant is *killed* where a test fails, fails again, or hangs ({HANGS[0]} times its time
and {HANGS[1]:g} s). It is *equivalent* where nothing that the code promises can change, for the reason given; this is judged by hand. Else it
*survived*: the tests that reach it passed, as many of them as a run has time for, the short ones first. *Not reached*: no test comes by.
Places move with the code: the page tells of the state that it was made of.

{len(random_ones)} mutants drawn: {total["killed"]} killed, {total["equivalent"]} equivalent, {total["survived"]} survived ({share:.1f} %).
{len(tests) - len(failing)} tests were used; {len(failing)} are left out, as they fail in the copy, whose source differs.

{table(head, rooms)}
{table(head, kinds)}
## Places found unguarded by hand

An audit by hand changed 96 decisions of an earlier state; 41 changes survived. Where each decision stands now, and what became of it:
{", ".join(f"{count} {verdict}" for verdict, count in hand.most_common())}.

{table(["", "change", "verdict", "by, or why"], by_hand)}
## Survivors of the draw

{table(["place and change", "verdict", "tests tried", "why"], survivors)}
## Tests left out

{", ".join(named(test) for test in failing) or "None"}.
""")
    return open_ones


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=240, help="mutants that are drawn")
    parser.add_argument("--budget", type=float, default=120.0, help="seconds of tests for each mutant and run")
    parser.add_argument("--fresh", action="store_true", help="forget the verdicts of earlier runs")
    arguments = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    saved = WORK / "results.json"
    state = {"results": {}, "broken": [], "traces": {}}
    if saved.is_file() and not arguments.fresh:
        state = json.loads(saved.read_text())
    keep = lambda: (saved.with_suffix(".new").write_text(json.dumps(state)), saved.with_suffix(".new").replace(saved))
    data = tomllib.loads((ROOT / LIST).read_text())
    entries = data["audit"]
    fixed = [listed(entry, (ROOT / entry["file"]).read_bytes()) for entry in entries if "gone" not in entry]
    explained = {named_by(e["file"], e["in"], e["from"], e["to"], e.get("nth", 0)): e for e in data.get("explained", [])}
    order = drawn(candidates(), arguments.seed)
    print(f"{len(order)} places", flush=True)
    mutants = compiled(fixed, order, arguments.count, state["broken"])
    keep()
    binaries = built()
    tests = traced(binaries, mutants, state["traces"])
    keep()
    print(f"{len(tests)} tests, {sum(t['seconds'] for _, _, t in tests.values()):.0f} s", flush=True)
    for number, mutant in enumerate(mutants):
        before = state["results"].get(key(mutant), {})
        if before.get("verdict") != "killed":
            kills = collections.Counter(result.get("by") for result in state["results"].values())
            result = judged(number, tests, before, kills, arguments.budget)
            state["results"][key(mutant)] = result
            keep()
            by = result.get("by", f"{len(result.get('passed', []))} of {result.get('reaching', 0)}")
            print(f"{number} {result['verdict']} {by} | {key(mutant)}", flush=True)
    unexplained = page(arguments, entries, mutants, state["results"], tests, explained)
    for mutant in unexplained:
        print("unexplained:", key(mutant))
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
