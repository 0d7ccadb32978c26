"""Builds the site; exit status 1 where Sphinx warns or a page would fetch something."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from website import offline, staging
from website.pages import ROOT

HERE = Path(__file__).resolve().parent


def build(out: Path, strict: bool = True) -> int:
    """Build the site into a folder. Sphinx' exit status."""
    source = out.parent / f"{out.name}-source"
    staging.stage(source)
    shutil.rmtree(out, ignore_errors=True)
    command = [sys.executable, "-m", "sphinx", "-q", "-b", "html", "-j", "2", "-c", str(HERE)]
    command += ["-W", "--keep-going"] if strict else []
    command += ["-d", str(out.parent / f"{out.name}-trees"), str(source), str(out)]
    return subprocess.run(command, check=False).returncode


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m website", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "site", help="the folder")
    parser.add_argument("--lax", action="store_true", help="warn only")
    given = parser.parse_args()
    status = build(given.out, not given.lax)
    twin = [sys.executable, str(ROOT / "docs/make_twin.py"), str(given.out / staging.TWIN)]
    status = status or subprocess.run(twin, check=False).returncode
    for line in (found := offline.fetched(given.out)):
        print(line)
    print(given.out / "index.html")
    return status or int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
