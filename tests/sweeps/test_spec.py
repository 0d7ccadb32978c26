"""What a spec file may say, and what is said of everything else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sweep_fake

from macromicro import batch
from macromicro.errors import InputError
from macromicro.sampling import MAX_LATIN
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import Spec, load


def real(tmp_path: Path, text: str) -> Spec:
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    return load(path, batch.job)[0]


HEAD = 'job = "fake"\nmethod = "random"\nsamples = 5\n'
GRID = 'job = "fake"\n'


def loaded(tmp_path: Path, text: str, name: str = "s.toml") -> Spec:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return load(path, sweep_fake.job)[0]


def test_a_grid_in_stored_units(tmp_path: Path) -> None:
    """Steps, values, one value and a plain value; nested tables and dotted keys."""
    text = """
job = "fake"
[parameters]
gain = [1, 2.5]
"part.force" = { low = "-20 mN", high = "40 mN", steps = 4 }
[parameters.part.mass]
low = "10 g"
high = "1 kg"
steps = 3
scale = "log"
[parameters.teeth]
value = 7
"""
    spec = loaded(tmp_path, text)
    assert [a.path for a in spec.axes] == ["gain", "part.force", "part.mass", "teeth"]
    assert spec.axes[0].levels == (1.0, 2.5)
    assert spec.axes[1].levels == pytest.approx((-0.02, 0.0, 0.02, 0.04), abs=1e-15)
    assert spec.axes[2].levels == pytest.approx((0.01, 0.1, 1.0), rel=1e-14)
    assert (spec.axes[2].levels[0], spec.axes[2].levels[-1]) == (0.01, 1.0)
    assert spec.axes[3].levels == (7.0,)
    assert spec.variants == 24
    assert np.array_equal(Sampler(spec).values(23, 1)[0][[0, 3]], [2.5, 7.0])


def test_ranges_relative_to_the_settings(tmp_path: Path) -> None:
    """A factor multiplies the parameter's value, a shift is added to it."""
    text = """
[parameters]
gain = { kind = "factor", low = 0.5, high = 2 }
"part.force" = { kind = "shift", low = "-100 mN", high = "0.25 N" }
"""
    gain, force = loaded(tmp_path, HEAD + text).axes
    assert (gain.low, gain.high) == (1.0, 4.0)
    assert (force.low, force.high) == pytest.approx((0.4, 0.75))
    steps = text.replace("high = 2 }", "high = 2, steps = 3 }").replace('N" }', 'N", steps = 2 }')
    gain, force = loaded(tmp_path, GRID + steps).axes
    assert gain.levels == (1.0, 2.5, 4.0) and force.levels == pytest.approx((0.4, 0.75))


def test_nothing_is_a_factor_of_zero(tmp_path: Path) -> None:
    text = "[parameters]\nbench.friction.random = { kind = 'factor', low = 1, high = 2 }\n"
    with pytest.raises(InputError, match=r"friction.random: a factor of 0 is 0. Give low and high"):
        real(tmp_path, HEAD.replace("fake", "macro-bench") + text)


def test_all_metrics_or_the_chosen_ones(tmp_path: Path) -> None:
    tail = "[parameters]\ngain = { low = 1, high = 2 }\n"
    every = loaded(tmp_path, HEAD + tail)
    assert every.metrics == ("product", "noise", "often") and every.columns == (0, 1, 2)
    some = loaded(tmp_path, HEAD + 'metrics = ["often", "product"]\n' + tail)
    assert some.metrics == ("often", "product") and some.columns == (2, 0)


def test_the_digest_is_of_what_decides_the_results(tmp_path: Path) -> None:
    """Not of words, spelling and units; but of each value, and of the parameters' order."""
    text = HEAD + '[parameters]\npart.mass = { low = "1 kg", high = "2 kg" }\ngain = [1]\n'
    same = HEAD.replace("job", "# a word\njob") + (
        '[parameters]\n"part.mass" = { high = "2000 g", low = "1 kg" }\ngain.values = [1.0]\n'
    )
    digest = loaded(tmp_path, text).digest
    assert loaded(tmp_path, same, "other.toml").digest == digest
    for old, new in (("2 kg", "3 kg"), ("samples = 5", "samples = 6"), ("[1]", "[1, 2]")):
        assert loaded(tmp_path, text.replace(old, new)).digest != digest
    turned = HEAD + '[parameters]\ngain = [1]\npart.mass = { low = "1 kg", high = "2 kg" }\n'
    assert loaded(tmp_path, turned).digest != digest


P = "[parameters]\n"
CASES = {
    "unknown key": ("jobs = 1\n" + HEAD, "s.toml, jobs: unknown key", "such as job"),
    "no job": ("method = 'grid'\n", "s.toml, job: 'nothing'", "name of a job"),
    "unknown job": ("job = 'fak'\n", "s.toml, job: 'fak'", "fake"),
    "unknown option": (
        HEAD + "[options]\nwidth = 1\n",
        "options.width: unknown key",
        "one of block, log",
    ),
    "bad option": (HEAD + "[options]\nlog = [1]\n", "s.toml, options.log: '[1]'", "text"),
    "unknown method": ("job='fake'\nmethod='lhc'\n", "s.toml, method: 'lhc'", "lhs"),
    "no method": ("job='fake'\nsamples=2\n", "s.toml, method: 'nothing'", "grid, random"),
    "no parameters": (HEAD, "s.toml, parameters: 'no parameters'", "[parameters.NAME]"),
    "empty table": (HEAD + P, "s.toml, parameters: 'no parameters'", "[parameters.NAME]"),
    "no samples": (
        "job='fake'\nmethod='lhs'\n[parameters]\ngain=[1]",
        "s.toml, samples: 'nothing'",
        "whole number from 1",
    ),
    "zero samples": (
        HEAD.replace("5", "0") + P + "gain=[1]",
        "s.toml, samples: '0'",
        "a whole number from 1",
    ),
    "grid with samples": (
        GRID + "method='grid'\nsamples = 3\n" + P + "gain=[1]",
        "s.toml, samples: not allowed",
        "a grid, which has its steps",
    ),
    "negative seed": (HEAD + "seed=-1\n" + P + "gain=[1]", "s.toml, seed: '-1'", "from 0"),
    "unknown metric": (
        HEAD + "metrics=['prodct']\n",
        "s.toml, metrics: 'prodct'",
        "such as product",
    ),
    "metric twice": (HEAD + "metrics=['noise','noise']\n", "s.toml, metrics", "once"),
    "no metrics": (HEAD + "metrics=[]\n", "s.toml, metrics", "a list of product"),
    "unknown parameter": (
        HEAD + P + "part.mas = ['1 kg']",
        "s.toml, parameters.part.mas: unknown key",
        "such as part.mass or part (`macromicro sweep fake --list` lists all)",
    ),
    "parameter in no table": (
        HEAD + P + "force = ['1 N']",
        "s.toml, parameters.force: unknown key",
        "such as part.force",
    ),
    "a set": (HEAD + P + "part = 3", "s.toml, parameters.part: '3'", "a table [part]"),
    "parameter twice": (
        HEAD + P + "part.mass=['1 kg']\n'part.mass'=['1 kg']",
        "s.toml, parameters.part.mass: set twice",
        "once",
    ),
    "text": (HEAD + P + "law=['a']", "s.toml, parameters.law: 'a'", "one number"),
    "no unit": (HEAD + P + "part.mass=[1]", "parameters.part.mass.values, item 1: '1'", "kg"),
    "wrong unit": (HEAD + P + "part.mass='3 N'", "part.mass.value: '3 N'", "kg"),
    "above its bound": (HEAD + P + "part.mass='11 kg'", "'11 kg'", "above zero and at most 10 kg"),
    "shown bound": (HEAD + P + "part.force='6 N'", "'6 N'", "from -5000 mN to 5000 mN"),
    "no range": (
        HEAD + P + "gain={}",
        "parameters.gain: there is no range",
        "value, values, or low",
    ),
    "two ways": (HEAD + P + "gain={value=1,low=2}", "gain: value and low are", "one of value"),
    "no high": (HEAD + P + "gain={low=1}", "parameters.gain.high: missing", "plain number"),
    "reversed": (HEAD + P + "gain={low=2,high=1}", "gain.high: '1'", "more than low (2)"),
    "equal": (HEAD + P + "gain={low=2,high=2}", "gain.high: '2'", "more than low (2)"),
    "log of zero": (
        HEAD + P + "gain={low=0,high=1,scale='log'}",
        "gain.low: '0'",
        "above zero for scale 'log'",
    ),
    "kind": (HEAD + P + "gain={low=0,high=1,kind='half'}", "gain.kind: 'half'", "one of value"),
    "kind of values": (HEAD + P + "gain={values=[1],kind='shift'}", "gain.kind: not", "values"),
    "factor beyond": (
        HEAD + P + "gain={low=1,high=1e9,kind='factor'}",
        "gain: '2e+9'",
        "at most 1000000",
    ),
    "scale": (HEAD + P + "gain={low=0,high=1,scale='ln'}", "gain.scale: 'ln'", "'linear' or 'log'"),
    "sample with steps": (
        HEAD + P + "gain={low=0,high=1,steps=3}",
        "gain.steps: not allowed",
        "with low",
    ),
    "grid without steps": (GRID + P + "gain={low=0,high=1}", "gain.steps: 'nothing'", "from 2"),
    "one step": (GRID + P + "gain={low=0,high=1,steps=1}", "gain.steps: '1'", "from 2"),
    "values and steps": (GRID + P + "gain={values=[1],steps=3}", "gain.steps", "not allowed with"),
    "no values": (GRID + P + "gain=[]", "gain.values: '[]'", "a list of 1"),
    "typing slip": (GRID + P + "gain={low=0,hihg=1}", "gain.hihg: unknown key", "such as high"),
    "half a tooth": (GRID + P + "teeth={low=1,high=4,steps=3}", "teeth.steps: 3", "whole numbers"),
    "broken teeth": (GRID + P + "teeth=1.5", "teeth.value: '1.5'", "a whole number"),
    "log of teeth": (HEAD + P + "teeth={low=1,high=4,scale='log'}", "teeth.scale", "'linear'"),
    "option's kind": (HEAD + "[options]\ndelay = true\n", "options.delay: 'True'", "a number"),
    "no seed to vary": (HEAD + P + "seed=[1]", "parameters.seed: unknown key", "gain"),
    "config": (HEAD + "config = 3\n" + P + "gain=[1]", "s.toml, config: '3'", "settings file"),
    "not TOML": ("job =", "s.toml", "TOML"),
}


@pytest.mark.parametrize("text, found, accepted", CASES.values(), ids=list(CASES))
def test_one_message_names_file_key_value_and_what_is_accepted(
    tmp_path: Path, text: str, found: str, accepted: str
) -> None:
    with pytest.raises(InputError) as caught:
        loaded(tmp_path, text)
    message = str(caught.value)
    assert str(tmp_path / "s.toml") in message
    assert found in message and accepted in message, message


def test_a_grid_beyond_all_bounds(tmp_path: Path) -> None:
    text = GRID + P + "gain={low=1,high=2,steps=10000}\n"
    text += "part.mass={low='1 kg',high='2 kg',steps=10000}\n"
    text += "part.force={low='1 N',high='2 N',steps=10000}\nteeth={low=1,high=99,steps=99}\n"
    with pytest.raises(InputError, match="99000000000000 variants"):
        loaded(tmp_path, text)


def test_no_file_and_another_kind_of_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load(tmp_path / "none.toml", sweep_fake.job)
    with pytest.raises(InputError, match=r"suffix is \.csv"):
        load(tmp_path / "none.csv", sweep_fake.job)


def test_whole_numbers_are_drawn_evenly(tmp_path: Path) -> None:
    """Of a Latin hypercube over 4 of them each gets a quarter."""
    spec = loaded(
        tmp_path,
        HEAD.replace("5", "400").replace("random", "lhs")
        + P
        + """
teeth = { low = 3, high = 6 }""",
    )
    drawn = Sampler(spec).values(0, 400)[:, 0]
    assert [int((drawn == n).sum()) for n in (3, 4, 5, 6)] == [100] * 4


def test_settings_and_seeds_of_the_real_jobs(tmp_path: Path) -> None:
    """A settings file beside the spec changes what all variants start from, and the digest."""
    (tmp_path / "mine.toml").write_text("[controller]\nmacro_law = 'pid'\n")
    text = (
        'job = "macro-bench"\n[options]\nlength = 1\n[parameters]\nbench.friction.coulomb = "9 N"\n'
    )
    (tmp_path / "plain.toml").write_text(text)
    (tmp_path / "law.toml").write_text('config = "mine.toml"\n' + text)
    plain, law = (load(tmp_path / f"{n}.toml", batch.job)[0] for n in ("plain", "law"))
    assert law.files == (("config controller.macro_law", '"pid"'),)
    assert law.canonical["config controller.macro_law"] == '"pid"'
    assert law.digest != plain.digest
    jobs = [batch.job(spec.job, **dict(spec.options)) for spec in (plain, law)]
    rows = [job.evaluate(Sampler(plain).variants(0, 1)) for job in jobs]
    assert not np.array_equal(*rows, equal_nan=True)
    noisy = 'job = "micro-bench"\n[parameters]\nseed = { low = 0, high = 4, steps = 5 }\n'
    assert real(tmp_path, noisy).axes[0].levels == (0.0, 1.0, 2.0, 3.0, 4.0)


def test_a_programme_that_changes_is_another_sweep(tmp_path: Path) -> None:
    moves = tmp_path / "moves.toml"
    text = f'job = "programme"\n[options]\nprogramme = "{moves}"\n[parameters]\nseed = [1, 2]\n'
    digests = []
    for place in ("10 mm", "20 mm", "10 mm"):
        moves.write_text(f'[[moves]]\nmacro = "{place}"\nhold = "1 s"\n')
        digests.append(real(tmp_path, text).digest)
    assert digests[0] == digests[2] != digests[1]


def test_what_a_real_job_says_of_its_options(tmp_path: Path) -> None:
    text = 'job = "macro-bench"\n[options]\nlength = -1\n'
    with pytest.raises(InputError, match=r"s\.toml, options\.length.*from 2 ms"):
        real(tmp_path, text)


def test_a_latin_hypercube_must_fit_into_memory(tmp_path: Path) -> None:
    """Twenty million numbers; what takes more is named."""
    most = MAX_LATIN // 2
    two = P + "\ngain = { low = 0, high = 1 }\nteeth = { low = 3, high = 6 }"
    head = HEAD.replace("random", "lhs")
    assert loaded(tmp_path, head.replace("5", str(most)) + two).variants == most
    with pytest.raises(InputError, match=rf"at most {most} for lhs with 2 .*sobol and random"):
        loaded(tmp_path, head.replace("5", str(most + 1)) + two)
