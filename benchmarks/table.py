"""Runs benchmarks, keeps their results and writes the tables of docs/benchmarks.md.

    python benchmarks/table.py newton dolfinx_beam      # runs these two, then writes all tables
    python benchmarks/table.py                          # runs none, only writes
    python benchmarks/table.py scaling -- --sizes 16 --keep benchmarks/measured/raw/sizes.json

What follows `--` goes to the benchmark, which must then be a single one; `--as NAME` keeps its results under another
name, for a benchmark that appears twice. Results are kept in benchmarks/measured/NAME.json. The text of the page is
written by hand; what stands between `<!-- NAME -->` and `<!-- end NAME -->` is replaced, for every NAME with results.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from measure import fail, markdown

HERE = Path(__file__).parent
MEASURED = HERE / "measured"
PAGE = HERE.parent / "docs" / "benchmarks.md"
SECTION = re.compile(r"<!-- (?P<name>\w+) -->\n.*?<!-- end (?P=name) -->", re.DOTALL)


def text(result: dict[str, Any]) -> str:
    """The results of one run in Markdown: its command, date and machine, and its tables."""
    head = f"`{result['command']}`, {result['date']}, {result['machine']}."
    tables = (f"{table['title']}\n\n{markdown(table['head'], table['rows'])}" for table in result["tables"])
    return "\n\n".join([head, *tables])


def rewritten(page: str, measured: Path) -> str:
    """The page with the section of every name for which there are results renewed."""

    def renew(section: re.Match[str]) -> str:
        name = section["name"]
        path = measured / f"{name}.json"
        if not path.exists():
            return section[0]
        return f"<!-- {name} -->\n\n{text(json.loads(path.read_text()))}\n\n<!-- end {name} -->"

    return SECTION.sub(renew, page)


def main() -> None:
    words, passed = sys.argv[1:], list[str]()
    if "--" in words:
        words, passed = words[: words.index("--")], words[words.index("--") + 1 :]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="BENCHMARK", help="a script of this folder, without .py")
    parser.add_argument("--as", dest="name", help="keep the results under this name")
    options = parser.parse_args(words)
    if (passed or options.name) and len(options.names) != 1:
        fail("options of a benchmark, or a name for its results, need exactly one benchmark")
    for name in options.names:
        if not (HERE / f"{name}.py").exists():
            fail(f"there is no benchmark {name}")
        target = MEASURED / f"{options.name or name}.json"
        subprocess.run([sys.executable, HERE / f"{name}.py", *passed, "--json", target], check=True)
    PAGE.write_text(rewritten(PAGE.read_text(), MEASURED))


if __name__ == "__main__":
    main()
