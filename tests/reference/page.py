"""Tables of docs/performance.md: each stands between the marks of the script that makes it."""

from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "performance.md"


def write(script, lines):
    """Puts them between its marks."""
    begin, end = f"<!-- {script} begins -->", f"<!-- {script} ends -->"
    text = PAGE.read_text()
    before, after = text.split(begin)[0], text.split(end)[1]
    PAGE.write_text("\n".join([f"{before}{begin}", *lines, f"{end}{after}"]))
