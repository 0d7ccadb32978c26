"""A user's folder outside the package: a law and a rig of one's own, and every command on them."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from macromicro.recording import Recording
from tests.command import BARE
from tests.command import command as macromicro
from tests.systems import posix
from tests.warm import Command

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
MACHINE = (DOCS / "own-machines.md").read_text("utf-8")
PARTS = re.findall(r"```python\n(.*?)```", MACHINE, re.DOTALL)[0]
COIL, SPREAD = re.findall(r"```toml\n(.*?)```", MACHINE, re.DOTALL)
PROCEDURE = re.findall(r"```python\n(# mylab/procedures.*?)```", MACHINE, re.DOTALL)[0]
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
FLEXURE = "mylab.machines:flexure"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty directory with a package, and files of settings beside it."""
    place = tmp_path_factory.mktemp("lab")
    (place / "mylab").mkdir()
    (place / "mylab" / "__init__.py").write_text(RIG, encoding="utf-8")
    (place / "mylab" / "laws.py").write_text(LAW + PLAIN, encoding="utf-8")
    (place / "mylab" / "machines.py").write_text(PARTS, encoding="utf-8")
    (place / "mylab" / "flexure.toml").write_text(SPREAD, encoding="utf-8")
    (place / "mylab" / "procedures.py").write_text(PROCEDURE, encoding="utf-8")
    (place / "coil.toml").write_text(COIL, encoding="utf-8")
    (place / "moves.toml").write_text(MOVES, encoding="utf-8")
    (place / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    (place / "mine.toml").write_text(
        f'[controller]\nmacro_law = "{SLIDING}"\n[controller.own]\nslope = "45 1/s"\n'
        '[controller.sequence]\nwait = "0.1 s"\n'
    )
    return place


def command(lab: Path, *words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    done = macromicro(*words, cwd=lab, env={"XDG_STATE_HOME": str(lab)})
    assert not check or done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
    return done


@contextmanager
def serving(lab: Path, *words: str) -> Iterator[Callable[[str], str]]:
    """A server of the lab's, and what asks it over SCPI."""
    process = Command(
        [sys.executable, "-m", "macromicro", "serve", "--scpi", "0", "--web", "-1", *words],
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

            yield ask
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60.0)


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
    done = command(lab, *BARE, "moves.toml", "--law", PLAINLY, "--out", "plain", "--json")
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
    done = command(lab, *BARE, "moves.toml", "--rig", "mylab:bench", "--config", "mine.toml",
                   "--yes", "--json", "--out", "both")  # fmt: skip
    assert "law_speed" in Recording.load(lab / "both" / "recording.h5")
    assert "interpreted" not in done.stderr and "from 10 to 20 mm" in done.stderr
    assert [abs(m["final_error"]) < 0.2 for m in json.loads(done.stdout)["moves"]] == [True, True]


@pytest.mark.slow
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


@pytest.mark.slow  # it compiles the whole bench with this law, about 5 s
def test_a_compiled_law_on_the_bench(lab: Path) -> None:
    command(lab, *BARE, "moves.toml", "--config", "mine.toml", "--out", "compiled")
    found = Recording.load(lab / "compiled" / "recording.h5")
    assert 50.0 < found["law_speed"].max() < 2e3 and "mm/s" in str(found.columns)
    done = command(lab, "robust", "--samples", "10", "--config", "mine.toml", "--programme",
                   "moves.toml", "--out", "robust", "--json")  # fmt: skip
    assert SLIDING in done.stdout


@pytest.mark.slow
def test_a_procedure_on_ones_own_rig(lab: Path) -> None:
    """It moves beyond 1 V there, so every push does."""
    done = command(lab, "collect", "mylab.procedures:pushes", "--rig", "mylab:bench", "--out", "p")
    assert (
        "28 runs" in done.stdout and "then: macromicro identify deadzone p/pushes.h5" in done.stdout
    )
    found = Recording.load(lab / "p" / "pushes.h5")
    assert found.attributes["from"] == "the middle"
    for run in (1, 28):
        rows = found["run"] == run
        moved = np.ptp(found["macro_position"][rows])
        assert moved > 1000.0
    refused = command(lab, "collect", "mylab.procedures:pushs", check=False)
    assert refused.returncode == 2 and "such as pushes" in refused.stderr


@pytest.mark.slow
def test_a_machine_with_parts_of_ones_own(lab: Path) -> None:
    """Compiled, with its own table of what is not known."""
    found = json.loads(command(lab, "doctor", "--machine", FLEXURE, "--json").stdout)
    assert {each["state"] for each in found} == {"ok"} and found[-1]["what"] == "model"
    (lab / "steps.toml").write_text('[[moves]]\nmacro = ["1 mm", "2.5 mm"]\nhold = "0.1 s"\n')
    done = command(lab, *BARE, "steps.toml", "--config", "coil.toml", "--out", "coil", "--json")
    told = json.loads(done.stdout)
    assert told["machine"] == FLEXURE and [m["arrived_s"] is not None for m in told["moves"]]
    assert told["overrides"]["blade.mass"] == "0.3 kg"
    assert "true_position" in Recording.load(lab / "coil" / "recording.h5")


COILS = """
job = "mylab.machines:flexure"
config = "coil.toml"
[parameters."blade.stiffness"]
low = "1500 N/m"
high = "2500 N/m"
steps = 2
"""


@pytest.mark.slow  # a compiled loop of it for each command
def test_studies_of_a_machine_of_ones_own(lab: Path) -> None:
    """They find its law's gains and its table; its settings are read back."""
    command(lab, "tune", "flexure", "--config", "coil.toml", "--evaluations", "10",
            "--out", "gains")  # fmt: skip
    tuned = (lab / "gains" / "tuned.toml").read_text("utf-8")
    assert f'machine = "{FLEXURE}"' in tuned and "[controller]" in tuned
    again = command(lab, *BARE, "--config", "gains/tuned.toml", "--out", "again", "--json")
    assert len(json.loads(again.stdout)["moves"]) == 4
    study = command(lab, "robust", "--config", "coil.toml", "--samples", "10", "--out", "spread",
                    "--json")  # fmt: skip
    assert json.loads(study.stdout)["machine"] == FLEXURE
    assert {"mass", "spring"} <= {q["name"] for q in json.loads(study.stdout)["parameters"]}
    command(lab, "response", "--config", "coil.toml", "--count", "4", "--out", "bode")
    (lab / "coils.toml").write_text(COILS, encoding="utf-8")
    command(lab, "sweep", "coils.toml", "--workers", "1", "--out", "coils")
    import pyarrow.parquet as pq

    table = pq.read_table(lab / "coils" / "results.parquet")
    assert table["missed"].to_pylist() == [0.0, 0.0] and len(set(table["effort"].to_pylist())) == 2


@pytest.mark.slow
def test_a_law_of_ones_own_on_a_machine_of_one_stage(lab: Path) -> None:
    """Compiled and in plain Python, on the package's axis and on one's own machine."""
    (lab / "axis.toml").write_text(
        f'machine = "axis"\nlaw = "{SLIDING}"\n[own]\nreach = "4 V"\nslope = "250 1/s"\n'
        'layer = "150 mm/s"\nsmooth = "0.2 ms"\n'
    )
    done = command(lab, *BARE, "moves.toml", "--config", "axis.toml", "--out", "axis", "--json")
    told = json.loads(done.stdout)
    assert all(m["arrived_s"] is not None for m in told["moves"])
    assert told["overrides"]["law"] == SLIDING and told["overrides"]["own.slope"] == "250 1/s"
    found = Recording.load(lab / "axis" / "recording.h5")
    assert "law_speed" in found and "integral" not in found
    # At rest it does not chatter: the effort keeps its sign and stands still but for a count.
    effort, still = found["effort"], np.abs(np.diff(found["target"], prepend=0.0)) == 0.0
    signs = np.sign(effort[still & (effort != 0.0)])
    assert np.count_nonzero(np.diff(signs)) < 20
    assert np.median(np.abs(np.diff(effort[still]))) < 0.1
    shown = command(lab, "config", "show", "--machine", "axis", "--law", PLAINLY).stdout
    assert f'law = "{PLAINLY}"' in shown and 'kp = "100 V/m"' in shown
    plain = command(lab, *BARE, "--config", "coil.toml", "--law", PLAINLY, "--out", "pl", "--json",
                    check=False)  # fmt: skip
    assert json.loads(plain.stdout)["overrides"]["own.kp"] == "100 V/m"
    tuned = command(lab, "tune", "axis", "--config", "axis.toml", "--evaluations", "10", "--out",
                    "axis-gains", "--json")  # fmt: skip
    names = [line["name"] for line in json.loads(tuned.stdout)["table"]]
    assert names[:4] == ["own.slope", "own.reach", "own.layer", "own.smooth"]
    refused = command(lab, *BARE, "--config", "coil.toml", "--law", "slidng", "--out", "no",
                      check=False)  # fmt: skip
    assert refused.returncode == 2 and "--law: 'slidng'; accepted:" in refused.stderr


@posix
@pytest.mark.slow  # compiled with its live loop
def test_a_machine_of_ones_own_is_served(lab: Path) -> None:
    (lab / "live-coil.toml").write_text(
        COIL + "[serve]\nmiss_share = 1.0\nloop_timeout = '5 s'\nparent_timeout = '5 s'\n",
        encoding="utf-8",
    )
    with serving(lab, "--config", "live-coil.toml", "--state", "coil.json") as ask:
        assert f"{FLEXURE} live-coil" in ask("*IDN?")
        assert ask("SYST:LOCK:REQ?;:ENAB;MOVE:ABS 1.5 MM;*OPC?;:SYST:ERR?") == '1;1;0,"No error"'
        place, width, trusted = map(float, ask("POS?").split(","))
        assert abs(place - 1.5) < 1e-3 and width < 0.1 and trusted == 1.0
        assert "absolute" in ask("HOME;:SYST:ERR?")


@posix
@pytest.mark.slow
def test_served(lab: Path) -> None:
    """The loop's process finds law and rig; gains are changed live, by their own names."""
    mine = (lab / "mine.toml").read_text("utf-8")
    mine = mine.replace("[controller]\n", '[controller]\ndead_zone = "1 V"\n')
    (lab / "live.toml").write_text(
        mine + "[serve]\nmiss_share = 1.0\nloop_timeout = '5 s'\nparent_timeout = '5 s'\n",
        encoding="utf-8",
    )
    with serving(
        lab, "--rig", "mylab:bench", "--config", "live.toml", "--state", "position.json"
    ) as ask:
        assert ask("SYST:LOCK:REQ?;:ENAB;HOME;*OPC?") == "1;1"
        assert ask("MOVE:MACR 200;*OPC?;:SYST:ERR?") == '1;0,"No error"'
        assert '"law_speed"' in ask("WAV:CAT?") and ask("WAV:UNIT?").endswith('"mm/s"')
        speeds = [float(each) for each in ask("WAV:DATA? LAW_SPEED,20").split(",")]
        assert max(map(abs, (v for v in speeds if v < 1e30))) > 10.0  # mm/s, on its way
        assert ask("WAV:DATA? law_2,1;:SYST:ERR?").startswith("-224")
        assert ask('GAIN? "own.slope"') == "45"
        assert ask('GAIN "own.slope",60;:SYST:ERR?') == '0,"No error"'
        assert ask('GAIN? "own.slope"') == "60"
        assert ask('GAIN? "macro_law"') == f'"{SLIDING}"'
        refused = ask('GAIN "macro_law","os.path:join";:SYST:ERR?')
        assert refused.startswith("-224") and SLIDING in refused
        assert "no micro-stage" in ask("MOVE:MICR 1 MM;:SYST:ERR?")


STAGES = """
from macromicro.machines import machine, rig


def axis(seed):
    made = machine.named("axis", "mylab")
    return rig.CompiledTwin(made.kind, made.settings, seed)
"""


@posix
@pytest.mark.slow  # forty strokes and a chirp, interpreted
def test_from_a_rig_of_ones_own_to_gains_that_are_used_on_it(lab: Path) -> None:
    """Commissioned, run, served, tuned, judged and exported by the file that was found."""
    (lab / "mylab" / "stages.py").write_text(STAGES, encoding="utf-8")
    mine, found = ("--rig", "mylab.stages:axis"), "found/machine.toml"
    pitch = "12.566370614359172 um"
    done = command(lab, "commission", *mine, "--pitch", pitch, "--effort", "10 V", "--yes",
                   "--out", "found")  # fmt: skip
    assert "verification: 7 of 7 moves arrived" in done.stdout
    told = json.loads(
        command(lab, *BARE, "moves.toml", "--config", found, *mine, "--yes", "--json").stdout
    )
    assert [m["arrived_s"] is not None for m in told["moves"]] == [True, True]
    assert "true_position" not in Recording.load(lab / "results" / "moves" / "recording.h5")
    lines = command(lab, "robust", "--config", found, "--samples", "10", "--json").stdout
    assert json.loads(lines)["machine"] == "axis"
    command(lab, "tune", "axis", "--config", found, "--evaluations", "10", "--out", "quick")
    command(lab, "response", "--config", found, "--count", "3", "--out", "bode-found")
    command(lab, "export", "c", "axis.law", "--config", found, "--out", "c-found")
    gain = re.search(r"position = ([0-9.]+)", command(lab, "config", "show", "controller",
                     "--config", found).stdout.replace('"', ""))  # fmt: skip
    assert gain is not None and gain[1] in (lab / "c-found" / "axis_law.c").read_text("utf-8")
    live = (lab / found).read_text("utf-8")
    (lab / "found-live.toml").write_text(
        live + "\n[serve]\nmiss_share = 1.0\nloop_timeout = '5 s'\nparent_timeout = '5 s'\n",
        encoding="utf-8",
    )
    with serving(lab, *mine, "--config", "found-live.toml", "--state", "found.json") as ask:
        assert ask("SYST:LOCK:REQ?;:ENAB;HOME;*OPC?") == "1;1"
        assert ask("MOVE:ABS 20 MM;*OPC?;:SYST:ERR?") == '1;0,"No error"'
        assert abs(float(ask("POS?").split(",")[0]) - 20.0) < 0.1


@pytest.mark.slow  # compiled with each law
def test_a_law_and_a_rig_of_ones_own_on_every_command_that_takes_them(lab: Path) -> None:
    """What the other tests here do not run: exports, two axes, records, plots, comparisons."""
    law = ("--law", SLIDING)
    (lab / "sm.toml").write_text(
        f'machine = "axis"\nlaw = "{SLIDING}"\n[own]\nreach = "4 V"\nslope = "250 1/s"\n'
        'layer = "150 mm/s"\nsmooth = "0.2 ms"\n'
    )
    (lab / "pair.toml").write_text(
        f'machine = "xy"\n[x]\nlaw = "{SLIDING}"\n[x.own]\nreach = "6 V"\nslope = "250 1/s"\n'
        'layer = "150 mm/s"\nsmooth = "0.2 ms"\n'
    )
    command(lab, "export", "c", SLIDING, "--out", "c-law")
    command(lab, "export", "c", "axis.law", "--config", "sm.toml", "--out", "c-axis")
    assert ".slope = 250.0" in (lab / "c-axis" / "axis_law.c").read_text("utf-8")
    names = command(lab, "export", "list", "--config", "coil.toml").stdout
    command(lab, "export", "c", f"{FLEXURE}.law", "--config", "coil.toml", "--out", "c-coil")
    assert f"{FLEXURE}.plant" in names
    shown = command(lab, "config", "show", "x.own", "--config", "pair.toml").stdout
    assert 'slope = "250 1/s"' in shown
    pair = json.loads(command(lab, *BARE, "--config", "pair.toml", "--json").stdout)
    assert pair["finished"]
    assert "x_law_speed" in Recording.load(lab / "results" / "pair" / "recording.h5")
    command(lab, *BARE, "moves.toml", "--config", "sm.toml", "--out", "one")
    (lab / "plain.toml").write_text(
        'machine = "axis"\n[own]\nreach = "6 V"\nslope = "250 1/s"\nlayer = "150 mm/s"\n'
        'smooth = "1 ms"\n'
    )
    command(lab, *BARE, "moves.toml", "--config", "plain.toml", *law, "--out", "two")
    compared = command(lab, "compare", "one", "two", "--out", "compared").stdout
    assert "law_speed" in compared
    command(lab, "plot", "one", "law_speed", "--out", "plotted.svg")
    listed = command(lab, "collect", "--list", "--config", "sm.toml").stdout
    assert listed.startswith("drive ")
    command(lab, "collect", "drive", "--config", "sm.toml", "--out", "records")
    command(lab, "identify", "drive", "records/drive.h5", "--out", "identified")
    command(lab, "doctor", "--rig", "mylab:bench", "--open")
    command(lab, "commission", "--config", "sm.toml", "--out", "anew")
