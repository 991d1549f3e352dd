#!/usr/bin/env python3
"""The documentation as a book in target/book/html: `python3 docs/book/build.py` (needs mdbook: `cargo install mdbook`).

The pages are those of SUMMARY.md, with the files that they link to; the gallery shows the circuits of netlists/ as `circ` draws them; the playground is
what playground/build.sh makes, where Rust can compile for browsers.
`CIRC=path` names a program that is built already.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
OWN = pathlib.Path(__file__).resolve().parent
BOOK = ROOT / "target" / "book"
SOURCE = BOOK / "src"
LINK = re.compile(r"\]\(([^)\s#]+)[^)]*\)")


def circ():
    if "CIRC" not in os.environ:
        subprocess.run(["cargo", "build", "--release"], cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return os.environ.get("CIRC", str(target / "release" / "circ"))


def copied(path):
    """A page or file under the name it has in the repository, with what it links to."""
    place = SOURCE / path
    if place.exists():
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(ROOT / path, place)
    if path.suffix != ".md":
        return
    for link in LINK.findall((ROOT / path).read_text()):
        linked = pathlib.Path(os.path.relpath((ROOT / path).parent / link, ROOT))
        if "://" not in link and (ROOT / linked).is_file():
            copied(linked)


def gallery(program):
    """Every circuit of netlists/: what it says of itself, its picture, its waveforms, its text."""
    pictures = SOURCE / "gallery"
    pictures.mkdir()
    page = ["# Gallery", "", "The circuits of `netlists/`, drawn by `circ graph` and run by `circ sim`."]
    for netlist in sorted((ROOT / "netlists").glob("*.cir")):
        lines = netlist.read_text().splitlines()
        title, name = lines[0].lstrip("* "), netlist.stem
        words = " ".join(line[1:].strip() for line in lines[1:] if re.match(r"\*\s", line))
        page += ["", f"## {name}", "", f"**{title}.** {words}", ""]
        for command, kind in (("graph", "circuit"), ("sim", "waveforms")):
            picture = pictures / f"{name}-{kind}.svg"
            made = subprocess.run([program, command, netlist, "-q", "-o", picture])
            if made.returncode == 0:
                page += [f"![{name}: {kind}](gallery/{picture.name})", ""]
        page += ["```text", *lines, "```"]
    (SOURCE / "gallery.md").write_text("\n".join(page) + "\n")


def playground():
    """The playground's files, or nothing where Rust has no target for browsers; a page that shows them."""
    built = subprocess.run([ROOT / "playground" / "build.sh"])
    if built.returncode not in (0, 3):
        built.check_returncode()
    page = ["# Playground", ""]
    if built.returncode == 0:
        shutil.copytree(ROOT / "playground" / "dist", SOURCE / "playground")
        page += ["A netlist on the left, what it does on the right; [on a page of its own](playground/index.html).", ""]
        page += ['<iframe src="playground/index.html" title="playground" style="width: 100%; height: 80vh; border: 1px solid"></iframe>']
    else:
        page += ["Left out of this book: the Rust that built it cannot compile for browsers (`wasm32-unknown-unknown`)."]
    (SOURCE / "playground.md").write_text("\n".join(page) + "\n")


def broken():
    """Links of the book that lead nowhere."""
    html = BOOK / "html"
    for page in sorted(html.rglob("*.html")):
        if page.name == "toc.html":
            continue
        for link in re.findall(r"(?:href|src)=\"([^\"#?]+)", page.read_text()):
            if "://" not in link and not link.startswith(("data:", "mailto:", "/")) and not (page.parent / link).exists():
                yield f"{page.relative_to(html)}: {link}"


def main():
    if shutil.which("mdbook") is None:
        print("mdbook is not there: `cargo install mdbook` brings it", file=sys.stderr)
        return 2
    shutil.rmtree(BOOK, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    shutil.copyfile(OWN / "book.toml", BOOK / "book.toml")
    summary = (OWN / "SUMMARY.md").read_text()
    (SOURCE / "SUMMARY.md").write_text(summary)
    for page in LINK.findall(summary):
        if page not in ("gallery.md", "playground.md"):
            copied(pathlib.Path(page))
    gallery(circ())
    playground()
    subprocess.run(["mdbook", "build", "-d", str(BOOK / "html"), str(BOOK)], check=True)
    faults = list(broken())
    print("\n".join(faults) or f"{BOOK / 'html' / 'index.html'}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
