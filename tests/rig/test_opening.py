"""``--rig MODULE:FACTORY``: what is found there, and what is said where it will not do."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from macromicro.control.calibration import Calibration
from macromicro.errors import InputError
from macromicro.rig import opening
from macromicro.rig.limits import Limits
from macromicro.rig.opening import open_rig
from macromicro.types import Sample

RIG = """
import math
from macromicro.types import Sample
from macromicro.control.calibration import shipped
from macromicro.rig.limits import Limits

seeds = []

class Rig:
    channels = ("t", "encoder", "hall")
    def __init__(self): self.clock = self
    def now(self): return 0.0
    def wait(self, dt): pass
    def read(self): return Sample(0.0, *[math.nan] * 5)
    def write(self, outputs): pass
    def stop(self): pass
    def __enter__(self): raise AssertionError("looking must not enter it")
    def __exit__(self, *what): pass

def bench(seed):
    seeds.append(seed)
    return Rig()

def oven(seed):
    rig = Rig()
    rig.kind, rig.channels = "kiln", ["thermocouple", "encoder"]
    rig.dt, rig.rest, rig.pitch = 0.5, 600, 1e-5
    return rig

def changed(**values):
    def make(seed):
        rig = Rig()
        for name, value in values.items():
            setattr(rig, name, value)
        return rig
    return make

calibrated = changed(calibration=shipped())
limited = changed(limits=Limits(hottest=120.0))
unlimited = changed(limits={"hottest": 120.0})
toaster = changed(kind="toaster")
strange = changed(channels=("encoder", "smell"))
text = changed(channels="encoder")
coarse = changed(dt=0.01)
unrested = changed(rest=-1.0)
uncalibrated = changed(calibration=[1.0])
clockless = changed(clock=3)
counting = changed(counted=True)
unsure = changed(counted=1)
telling = changed(timed=True)
cycling = changed(kind="cycle", channels=("encoder",), dt=0.01)
mixed = changed(channels=("encoder", 5))
single = changed(channels=5)
kinds = changed(kind=["bench"])
hasty = changed(kind="kiln", channels=["encoder"], dt=0)
whole = changed(kind="kiln", channels=["encoder"], dt=1)
true = changed(kind="kiln", channels=["encoder"], dt=True)
restless = changed(rest=math.inf)
tired = changed(rest="600 s")
flat = changed(pitch=0.0)
number = 5

def nothing(seed): return None
def seedless(): return Rig()
def two(seed, more): return Rig()

class Bare(Rig):
    def __init__(self): pass

def timeless(seed): return Bare()

class Deaf(Rig):
    channels = property()

def deaf(seed): return Deaf()
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Writes the working directory's module `my_rigs`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def write(text: str) -> None:
        (tmp_path / "my_rigs.py").write_text(text, encoding="utf-8")

    write(RIG)
    yield write
    sys.modules.pop("my_rigs", None)


def test_a_bench_is_what_it_says(module: object) -> None:
    """The seed reaches the factory; nothing is entered; what is not said is the default."""
    found = open_rig("my_rigs:bench", seed=7)
    assert found.name == "my_rigs:bench" and found.kind == "bench"
    assert found.channels == ("encoder", "hall")
    assert (found.dt, found.rest, found.table) == (1e-3, 0.0, None)
    assert found.counted is found.timed is False and found.pitch == 14e-6
    found.make(9)
    assert sys.modules["my_rigs"].seeds == [7, 9]
    sample = found.open(1).read()
    assert isinstance(sample, Sample)


def test_a_kiln_says_more(module: object) -> None:
    found = open_rig("my_rigs:oven")
    assert found.kind == "kiln" and found.channels == ("thermocouple", "encoder")
    assert (found.dt, found.rest, found.pitch) == (0.5, 600.0, 1e-5)


def test_its_own_calibration_and_limits_are_kept(module: object) -> None:
    assert isinstance(open_rig("my_rigs:calibrated").table, Calibration)
    assert open_rig("my_rigs:bench").limits is None
    assert open_rig("my_rigs:limited").limits == Limits(hottest=120.0)
    assert open_rig("my_rigs:counting").counted is True
    assert open_rig("my_rigs:telling").timed is True
    assert open_rig("my_rigs:whole").dt == 1.0
    assert open_rig("my_rigs:coarse", alone=True).dt == 0.01  # one stage, whatever its period
    with pytest.raises(InputError, match=r"accepted: 0\.001 s for a cycle"):
        open_rig("my_rigs:cycling", alone=True)
    open_rig("my_rigs:bench")
    assert sys.modules["my_rigs"].seeds[-1] == 0


def test_another_process_may_have_it(module: object) -> None:
    found = open_rig("my_rigs:bench")
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    assert type(again.make(0)).__name__ == "Rig"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("real", "twin, MODULE:FACTORY"),
        ("", "twin, MODULE:FACTORY"),
        ("my_rigs:", "twin, MODULE:FACTORY"),
        ("my_rigs:bench()", "twin, MODULE:FACTORY"),
        ("os.system('x'):y", "twin, MODULE:FACTORY"),
        ("no_such_lab:bench", "no module no_such_lab"),
        ("my_rigs.inner:bench", "no module my_rigs.inner"),
        ("my_rigs:absent", "a function of my_rigs, such as bench"),
        ("my_rigs:number", "a function that takes a seed"),
        ("my_rigs:seedless", "a function that takes a seed"),
        ("my_rigs:two", "a function that takes a seed"),
        ("my_rigs:nothing", "NoneType without read, write, stop"),
        ("my_rigs:clockless", "without clock.now, clock.wait"),
        ("my_rigs:timeless", "returned Bare without clock."),
        ("my_rigs:deaf", "returned Deaf without channels."),
        ("my_rigs:kinds", "bench or kiln or cycle"),
        ("my_rigs:toaster", "bench or kiln or cycle"),
        ("my_rigs:strange", "smell"),
        ("my_rigs:text", "a tuple of names"),
        ("my_rigs:mixed", "a tuple of names"),
        ("my_rigs:single", "a tuple of names"),
        ("my_rigs:hasty", "dt: '0'; accepted: a number above 0"),
        ("my_rigs:true", "dt: 'True'; accepted: a number above 0"),
        ("my_rigs:restless", "rest: 'inf'; accepted: a number, 0 or more"),
        ("my_rigs:tired", "rest: '600 s'; accepted: a number, 0 or more"),
        ("my_rigs:flat", "pitch: '0.0'; accepted: a number above 0"),
        ("my_rigs:unsure", "a builtins.bool"),
        ("my_rigs:coarse", "0.001 s for a bench"),
        ("my_rigs:unrested", "0 or more"),
        ("my_rigs:uncalibrated", "Calibration"),
        ("my_rigs:unlimited", "macromicro.rig.limits.Limits"),
    ],
)
def test_what_will_not_do_is_said(module: object, name: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        open_rig(name)
    assert said in str(caught.value) and "--rig" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_module_s_own_missing_import_is_named(module: Callable[[str], None]) -> None:
    module("import no_such_driver\n")
    with pytest.raises(InputError, match="no module no_such_driver, which my_rigs imports"):
        open_rig("my_rigs:bench")


def test_an_installed_package_offers_its_rigs_by_plain_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    offered = {"bench-1": "myrig:bench", "broken": "myrig"}
    monkeypatch.setattr(
        opening.plugins, "entry_points", lambda group: offered if group == opening.GROUP else {}
    )
    assert str(opening.named("bench-1")) == "myrig:bench"
    for name in ("bench-2", "broken"):
        with pytest.raises(InputError, match=r"replay:FILE .*; installed: bench-1, broken"):
            opening.named(name)
