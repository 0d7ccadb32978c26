"""The built firmware that the package carries: its hash, and the command that writes it."""

from __future__ import annotations

import hashlib
import subprocess
from pathlib import Path

import pytest

from macromicro.errors import MacromicroError
from macromicro.rig.board import prebuilt
from tests.command import command


def _exported(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return command("export", "hex", *words, cwd=folder)


def test_the_command_writes_a_file_for_avrdude_and_its_hash(tmp_path: Path) -> None:
    done = _exported(tmp_path)
    assert done.returncode == 0, done.stderr
    data = (tmp_path / "uno.hex").read_bytes()
    lines = data.split()
    assert lines[-1] == b":00000001FF"
    assert all(sum(bytes.fromhex(line[1:].decode())) % 256 == 0 for line in lines)  # Intel HEX
    assert hashlib.sha256(data).hexdigest() in done.stdout
    subprocess.run(["sha256sum", "--check", "uno.hex.sha256"], cwd=tmp_path, check=True)
    again = _exported(tmp_path)
    assert again.returncode == 2 and "--overwrite" in again.stderr
    assert _exported(tmp_path, "--overwrite").returncode == 0


def test_a_damaged_file_is_not_given_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = hashlib.sha256(b"whole").hexdigest()
    (tmp_path / "uno.hex.sha256").write_text(f"{digest}  uno.hex\n")
    (tmp_path / "uno.hex").write_bytes(b"whole")
    monkeypatch.setattr(prebuilt, "files", lambda package: tmp_path)
    assert prebuilt.firmware() == b"whole"
    (tmp_path / "uno.hex").write_bytes(b"half")
    with pytest.raises(MacromicroError, match=r"uno\.hex of this package is damaged: install"):
        prebuilt.firmware()
