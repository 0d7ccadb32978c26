"""A half-open connection: no packet comes through any more, and no farewell."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NEEDED = ("unshare", "ip")
JOG = ("scpi", "epics")  # what the others do has ended by then


def own_network() -> bool:
    """May this process have a network of its own? (It needs the privilege to make one.)"""
    if any(shutil.which(name) is None for name in NEEDED):
        return False
    command = ["unshare", "-n", "ip", "link", "set", "lo", "up"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("protocol", ["scpi", "gcs", "page", "epics"])
def test_a_pulled_cable(tmp_path: Path, protocol: str, record_property: Any) -> None:
    """The system's keep-alive finds it, whatever the client speaks: control is free, and what
    still moves ends as lost."""
    if protocol == "epics":
        pytest.importorskip("caproto")
        pytest.importorskip("epics")
    if not own_network():
        pytest.skip("no network of one's own here: run as root, with iproute2 and util-linux")
    script = Path(__file__).with_name("cable.py")
    done = subprocess.run(
        ["unshare", "-n", sys.executable, str(script), str(tmp_path), protocol],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["outcome"] == ("lost" if protocol in JOG else "done")
    assert told["holder"] == "" and told["seconds"] < 30.0
    record_property("seconds", told["seconds"])
    print(f"found after {told['seconds']:.1f} s")
