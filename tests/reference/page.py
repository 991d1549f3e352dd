"""Tables of docs/performance.md: each stands between the marks of the script that makes it."""

import fcntl
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "performance.md"


def write(script, lines):
    """Puts them between its marks."""
    begin, end = f"<!-- {script} begins -->", f"<!-- {script} ends -->"
    with PAGE.open("r+") as page:
        # Two scripts may end at once.
        fcntl.flock(page, fcntl.LOCK_EX)
        text = page.read()
        before, after = text.split(begin)[0], text.split(end)[1]
        page.seek(0)
        page.truncate()
        page.write("\n".join([f"{before}{begin}", *lines, f"{end}{after}"]))
