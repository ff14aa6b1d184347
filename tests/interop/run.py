"""Runs the cases of the named programs, and prints their rows as a table or as JSON."""

import argparse
import importlib
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from case import Row


def rows_of(program: str, folder: Path) -> list[Row]:
    """The rows of one program, in a process of its own: some crash, and some cannot be loaded beside each other."""
    typed = [sys.executable, __file__, "--alone", program, "--folder", str(folder)]
    done = subprocess.run(typed, capture_output=True, text=True, check=False)
    try:
        return [Row(**row) for row in json.loads(done.stdout.strip().splitlines()[-1])]
    except (IndexError, json.JSONDecodeError):
        fault = f"ended with {done.returncode}: {done.stderr.strip()[-2000:]}"
        return [Row(program, "", "", faults=[fault])]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*")
    parser.add_argument("--alone", metavar="PROGRAM")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--rows", type=Path, help="file to write the rows of the table to, in Markdown")
    typed = parser.parse_args()
    if typed.alone:
        module = importlib.import_module(f"programs.with_{typed.alone}")
        rows = []
        for index, case in enumerate(module.CASES):
            rows += case.rows(typed.folder / f"{typed.alone}_{index}")
        print("\n" + json.dumps([asdict(row) for row in rows]))
        return 0
    folder = typed.folder or Path(tempfile.mkdtemp(prefix="normend_interop_"))
    rows = [row for program in typed.programs for row in rows_of(program, folder)]
    lines = ["| Program | Format | Way | Points | Normals | Other values | Remarks |", "|---|---|---|---|---|---|---|"]
    lines += ["| " + " | ".join(row.cells()) + " |" for row in rows]
    for row in rows:
        for fault in row.faults:
            print(f"interop: {row.program}, {row.format}, {row.way}: {fault}", file=sys.stderr)
    text = "\n".join(lines) + "\n"
    if typed.rows:
        typed.rows.write_text(text, encoding="utf-8")
    else:
        print(text, end="")
    return 1 if any(row.faults for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
