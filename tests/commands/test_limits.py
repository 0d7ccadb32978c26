"""`macromicro limits`: a table, JSON, and what is refused."""

import json
import sys
from pathlib import Path

import pytest

from macromicro import cli
from macromicro.design import fine_limits
from macromicro.design.limits import quickest
from macromicro.settings import Settings


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["macromicro", "limits", *words])
    return cli.main()


def test_table_and_json_say_the_same(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "40 mm", "--json") == 0
    found = json.loads(capsys.readouterr().out)["quickest"]
    wanted = quickest(Settings().bench, Settings().sensors, 0.04)
    assert found[0]["time"] == wanted.time
    assert run(monkeypatch, "40 mm") == 0
    assert f"{wanted.time:.3f} s" in capsys.readouterr().out


def test_a_file_of_settings_is_the_bench(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "sticky.toml"
    file.write_text('[bench.friction]\ncoulomb = "12 N"\n')
    assert run(monkeypatch, "40 mm", "--config", str(file), "--json") == 0
    slow = json.loads(capsys.readouterr().out)["quickest"][0]["time"]
    assert slow > quickest(Settings().bench, Settings().sensors, 0.04).time


@pytest.mark.parametrize(
    ("way", "said"), [("40", "its unit"), ("-1 mm", "above zero"), ("3 kg", "its unit")]
)
def test_a_way_is_a_length(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], way: str, said: str
) -> None:
    assert run(monkeypatch, "--", way) == 2
    assert said in capsys.readouterr().err


def test_those_of_the_micro_stage(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = fine_limits.turns(Settings().bench, Settings().sensors, [0.5e-3, 0.2e-3])
    assert run(monkeypatch, "--micro", "500 um", "0.2 mm", "--json") == 0
    found = json.loads(capsys.readouterr().out)["quickest"]
    assert [each["time"] for each in found] == [each.time for each in wanted]
    assert run(monkeypatch, "--micro", "500 um", "0.2 mm") == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].split() == ["from", "to", "to", "10", "um"]
    assert shown[2].endswith(f"0.200 mm  {wanted[1].time:>8.3f} s")
    assert run(monkeypatch, "--micro", "9 mm") == 2
    assert "reaches within a minute" in capsys.readouterr().err
