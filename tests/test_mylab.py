"""A user's folder outside the package: a law and a rig of one's own, and every command on them."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from macromicro.recording import Recording

DOCS = Path(__file__).parents[1] / "docs"
LAW = re.findall(r"```python\n(.*?)```", (DOCS / "laws.md").read_text("utf-8"), re.DOTALL)[0]
RIG = re.findall(r"```python\n(.*?)```", (DOCS / "rigs.md").read_text("utf-8"), re.DOTALL)[0]
PLAIN = '''

class PlainGains(NamedTuple):
    kp: Annotated[float, Par("V/m", "gain", "mine", positive=True, hi=1e4)] = 100.0
    kd: Annotated[float, Par("V*s/m", "gain", "mine", positive=True, hi=1e4)] = 6.0


class Plain:
    """No kernel: it runs interpreted."""

    gains, memory, start = PlainGains, Memory, staticmethod(start)

    @staticmethod
    def step(gains, memory, target, sample, dt):
        speed = (sample.position - memory.position) / dt
        effort = gains.kp * (target.position - sample.position) - gains.kd * speed
        return Memory(sample.position, speed), effort
'''
MOVES = '[[moves]]\nmacro = ["10 mm", "20 mm"]\nhold = "0.2 s"\n'
SWEEP = """
job = "macro-bench"
config = "mine.toml"
[options]
length = 0.6
[parameters."controller.own.slope"]
low = "40 1/s"
high = "60 1/s"
steps = 3
"""
SLIDING, PLAINLY = "mylab.laws:sliding_mode", "mylab.laws:Plain"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty directory with a package, and files of settings beside it."""
    place = tmp_path_factory.mktemp("lab")
    (place / "mylab").mkdir()
    (place / "mylab" / "__init__.py").write_text(RIG, encoding="utf-8")
    (place / "mylab" / "laws.py").write_text(LAW + PLAIN, encoding="utf-8")
    (place / "moves.toml").write_text(MOVES, encoding="utf-8")
    (place / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    (place / "mine.toml").write_text(
        f'[controller]\nmacro_law = "{SLIDING}"\n[controller.own]\nslope = "45 1/s"\n'
        '[controller.sequence]\nwait = "0.1 s"\n'
    )
    return place


def command(lab: Path, *words: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-m", "macromicro", *words], cwd=lab, stdin=subprocess.DEVNULL,
        env={**os.environ, "XDG_STATE_HOME": str(lab)}, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
    return done


def test_its_gains_are_settings(lab: Path) -> None:
    shown = command(lab, "config", "show", "controller.own", "--law", SLIDING).stdout
    assert 'slope = "50 1/s"  # slope of the sliding line (mine)' in shown


def test_doctor_finds_both(lab: Path) -> None:
    for law, speed in ((SLIDING, "yes, with the same efforts"), (PLAINLY, "no: plain Python")):
        found = json.loads(command(lab, "doctor", "--law", law, "--json").stdout)
        assert {each["state"] for each in found} == {"ok"} and found[-1]["what"] == "speed"
        assert speed in found[-2]["found"]
    listed = command(lab, "doctor", "--rig", "mylab:bench", "--web", "-1", "--scpi", "-1").stdout
    assert "mylab:bench: found, not opened" in listed


def test_a_plain_law_runs_at_once(lab: Path) -> None:
    done = command(lab, "run", "moves.toml", "--law", PLAINLY, "--out", "plain", "--json")
    assert "it runs interpreted" in done.stderr
    assert [abs(m["final_error"]) < 0.2 for m in json.loads(done.stdout)["moves"]] == [True, True]
    found = Recording.load(lab / "plain" / "recording.h5")
    assert 50.0 < found["law_speed"].max() < 2e3  # mm/s
    about = found.attributes
    told = json.loads(str(about["overrides"]))
    assert told == {
        "controller.macro_law": PLAINLY, "controller.own.kp": "100 V/m",
        "controller.own.kd": "6 V*s/m",
    }  # fmt: skip


def test_a_law_on_a_rig(lab: Path) -> None:
    """Both of one's own."""
    done = command(lab, "run", "moves.toml", "--rig", "mylab:bench", "--config", "mine.toml",
                   "--yes", "--json", "--out", "both")  # fmt: skip
    assert "law_speed" in Recording.load(lab / "both" / "recording.h5")
    assert "interpreted" not in done.stderr and "from 10 to 20 mm" in done.stderr
    assert [abs(m["final_error"]) < 0.2 for m in json.loads(done.stdout)["moves"]] == [True, True]


def test_a_sweep_and_a_search(lab: Path) -> None:
    """Worker processes find the law by themselves; one that is edited is another sweep."""
    command(lab, "sweep", "sweep.toml", "--workers", "1", "--out", "swept")
    import pyarrow.parquet as pq

    table = pq.read_table(lab / "swept" / "results.parquet")
    assert table["controller.own.slope"].to_pylist() == [40.0, 50.0, 60.0]
    rise = table["rise_time"].to_pylist()
    assert len(set(rise)) > 1 and max(rise) < 0.6
    command(lab, "tune", "macro", "--config", "mine.toml", "--evaluations", "4", "--out", "tuned")
    tuned = (lab / "tuned" / "tuned.toml").read_text("utf-8")
    assert f'macro_law = "{SLIDING}"' in tuned and "[controller.own]" in tuned
    assert "linear part" in tuned


@pytest.mark.slow  # it compiles the whole bench with this law, about 10 s
def test_a_compiled_law_on_the_bench(lab: Path) -> None:
    command(lab, "run", "moves.toml", "--config", "mine.toml", "--out", "compiled")
    found = Recording.load(lab / "compiled" / "recording.h5")
    assert 50.0 < found["law_speed"].max() < 2e3 and "mm/s" in str(found.columns)
    done = command(lab, "robust", "--samples", "10", "--config", "mine.toml", "--programme",
                   "moves.toml", "--out", "robust", "--json")  # fmt: skip
    assert SLIDING in done.stdout


def test_served(lab: Path) -> None:
    """The loop's process finds law and rig; gains are changed live, by their own names."""
    mine = (lab / "mine.toml").read_text("utf-8")
    mine = mine.replace("[controller]\n", '[controller]\ndead_zone = "1 V"\n')
    (lab / "live.toml").write_text(
        mine + "[serve]\nmiss_share = 1.0\nloop_timeout = '5 s'\n", encoding="utf-8"
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "macromicro", "serve", "--rig", "mylab:bench", "--scpi", "0",
         "--web", "-1", "--config", "live.toml", "--state", "position.json"],
        cwd=lab, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env={**os.environ, "MACROMICRO_TOKEN": ""},
    )  # fmt: skip
    try:
        assert process.stdout is not None
        ports = (re.match(r"SCPI: \S+ port (\d+)", line) for line in process.stdout)
        port = next(int(found[1]) for found in ports if found)
        with socket.create_connection(("127.0.0.1", port), timeout=60.0) as line:
            answers = line.makefile()

            def ask(words: str) -> str:
                line.sendall(f"{words}\n".encode())
                return answers.readline().strip()

            assert ask("SYST:LOCK:REQ?;:ENAB;HOME;*OPC?") == "1;1"
            assert ask("MOVE:MACR 200;*OPC?;:SYST:ERR?") == '1;0,"No error"'
            assert ask('GAIN? "own.slope"') == "45"
            assert ask('GAIN "own.slope",60;:SYST:ERR?') == '0,"No error"'
            assert ask('GAIN? "own.slope"') == "60"
            assert ask('GAIN? "macro_law"') == f'"{SLIDING}"'
            refused = ask('GAIN "macro_law","os.path:join";:SYST:ERR?')
            assert refused.startswith("-224") and SLIDING in refused
            assert "no micro-stage" in ask("MOVE:MICR 1 MM;:SYST:ERR?")
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60.0)
