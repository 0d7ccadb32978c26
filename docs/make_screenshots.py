"""Draws docs/figures/reproduction.png: the top of the page that `macromicro reproduce` writes,
as Chromium shows it.

    python docs/make_screenshots.py
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURE = Path(__file__).resolve().parent / "figures" / "reproduction.png"
WIDTH, HEIGHT = 1280, 1500


def shoot(page: Path, picture: Path) -> None:
    """A picture [PNG] of the page's first screen. Raises CalledProcessError, FileNotFoundError."""
    browser = shutil.which("chromium")
    if browser is None:
        raise FileNotFoundError("no chromium here; `make browser` installs it")
    with tempfile.TemporaryDirectory() as profile:
        subprocess.run(
            [
                browser,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--disable-dev-shm-usage",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--hide-scrollbars",
                f"--user-data-dir={profile}",
                f"--window-size={WIDTH},{HEIGHT}",
                f"--screenshot={picture}",
                page.as_uri(),
            ],
            check=True,
            stderr=subprocess.DEVNULL,
            timeout=120,
        )


def main() -> None:
    """Reproduce everything and write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "reproduction"
        command = [sys.executable, "-m", "macromicro", "reproduce", "--out", str(out)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        PICTURE.parent.mkdir(parents=True, exist_ok=True)
        shoot(out / "reproduction.html", PICTURE)


if __name__ == "__main__":
    main()
