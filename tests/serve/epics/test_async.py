"""ophyd-async's motor over Channel Access, and what may write where a token is asked for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("caproto")
pytest.importorskip("aioca")
pytest.importorskip("ophyd_async")
sys.path.insert(0, str(Path(__file__).parent))
import epics_parts as parts


def client(*words: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_a_failed_stopped_or_refused_move_is_a_failure(tmp_path: Path) -> None:
    with parts.serving(tmp_path):
        said = client(str(Path(__file__).parent / "async_client.py"), parts.PREFIX)
    assert [line.partition(":")[0] for line in said] == [
        "refused", "done", "stopped", "again", "limits",
    ]  # fmt: skip
    assert said[1] == "done: True" and said[3] == "again: True"
    assert "limits: MotorLimitsError" in said


@pytest.mark.slow
def test_with_a_token_only_stops_can_be_written(tmp_path: Path) -> None:
    script = (
        "import epics\n"
        f"names = ['whole', 'whole.STOP', 'enable', 'emergency', 'mode']\n"
        f"for name in names:\n    pv = epics.PV('{parts.PREFIX}:' + name, connection_timeout=20)\n"
        "    pv.wait_for_connection(20)\n    print(name, pv.write_access)\n"
    )
    with parts.serving(tmp_path, token="sesame"):
        said = client("-c", script)
    assert said == [
        "whole False", "whole.STOP True", "enable False", "emergency True", "mode False",
    ]  # fmt: skip
