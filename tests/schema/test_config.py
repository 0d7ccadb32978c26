"""Settings files over a toy tree: exact round trip, units, bounds, one sentence for a slip."""

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.schema.config import as_toml, check, difference, load_overrides
from macromicro.schema.par import Par, entries, replaced


class Friction(NamedTuple):
    coulomb: Annotated[float, Par("N", "kinetic level", "Section 4.2", lo=0.0, hi=100.0)] = 9.0
    ripple: Annotated[float, Par("m", "period of the ripple", shown="mm", positive=True)] = 0.037


class Heat(NamedTuple):
    ambient: Annotated[float, Par("degC", "room", lo=-20.0, hi=60.0)] = 22.0
    latent: Annotated[float, Par("K", "latent heat as temperature")] = 24.0
    stop: Annotated[float, Par("m", "the stop", shown="mm", positive=True, hi=5e-3)] = 3.98e-3
    stroke: Annotated[float, Par("m", "the stroke", shown="mm")] = 4e-3
    map_volts: Annotated[tuple[float, ...], Par("V", "heat map", shown="mV", lo=0.0, hi=5.0)] = (
        1.25,
        1.3,
        5.0,
    )

    def problems(self) -> list[tuple[str, object, str]]:
        if self.stop > self.stroke:
            return [("stop", f"{self.stop * 1e3:g} mm", "at most the stroke")]
        return []


class Bench(NamedTuple):
    heat: Heat = Heat()
    friction: Friction = Friction()
    load: Annotated[float, Par("N", 'weight "on" the stage\nof 30 gf', shown="gf")] = 0.2941995
    share: Annotated[float, Par("", "share of the belt", lo=0.0, hi=1.0)] = 0.014
    part: Annotated[float, Par("", "part", shown="%")] = 0.3


class Toy(NamedTuple):
    bench: Bench = Bench()
    seed: Annotated[int, Par("", "seed", lo=0)] = 2**63 - 1
    length: Annotated[int, Par("counts", "travel")] = 2800
    fan: Annotated[bool, Par("", "fan on")] = False
    law: Annotated[str, Par("", "control law", choices=("pd", "pid"))] = "pd"
    label: Annotated[str, Par("", "a name")] = "toy"
    unset: Annotated[float, Par("V", "nothing yet")] = math.nan
    hidden: float = 1.0

    def problems(self) -> list[tuple[str, object, str]]:
        return [("bench.load", "heavy", "under 1 N")] if self.bench.load > 1.0 else []


def read(folder: Path, text: str | bytes) -> Any:
    file = folder / "wide.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_overrides(file, Toy())


def refused(folder: Path, text: str | bytes) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text)
    message = str(caught.value)
    assert message.startswith(str(folder / "wide.toml"))
    assert "\n" not in message
    return message.removeprefix(str(folder))


def test_values_with_units_land_in_their_place(tmp_path: Path) -> None:
    text = """
    fan = true
    law = "pid"
    seed = 7
    length = "1400 counts"
    label = "mine"
    [bench]
    share = 0.5
    part = "40 %"
    load = "10 gf"
    [bench.friction]
    coulomb = "11 N"
    ripple = "40 mm"
    [bench.heat]
    ambient = "30 degC"
    latent = "14 K"
    map_volts = ["1 V", "1500 mV"]
    """
    new = read(tmp_path, text)
    assert (new.fan, new.law, new.seed, new.length, new.label) == (True, "pid", 7, 1400, "mine")
    assert (new.bench.share, new.bench.part, new.bench.load) == (0.5, 0.4, 0.0980665)
    assert new.bench.friction == Friction(11.0, 0.04)
    assert new.bench.heat == Heat(30.0, 14.0, map_volts=(1.0, 1.5))
    assert isinstance(new.length, int)


def test_what_is_not_named_keeps_its_default(tmp_path: Path) -> None:
    new = read(tmp_path, "bench.friction.coulomb = '11 N'")
    assert difference(new, Toy()) == {"bench.friction.coulomb": '"11 N"'}
    assert new == replaced(Toy(), "bench.friction.coulomb", 11.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        # unknown keys, with the nearest
        ("[bench.friction]\ncolomb = '1 N'", ["bench.friction.colomb", "bench.friction.coulomb"]),
        ("[bench.frction]\ncoulomb = '1 N'", ["bench.frction", "bench.friction"]),
        ("coulomb = '1 N'", ["coulomb", "bench.friction.coulomb"]),
        ("zzz = 1", ["zzz", "unknown key", "macromicro config show"]),
        ("hidden = 2.0", ["hidden", "unknown key"]),
        ('"" = 0.5', ["unknown key"]),
        ('"a\\nb" = 1', ["a\\nb", "unknown key"]),
        ("[fan]\non = true", ["fan", "true or false"]),
        ("bench = 5", ["bench", "a table [bench] with heat, friction, load"]),
        # units
        ("[bench.friction]\ncoulomb = 11", ["coulomb", "'11'", "N, mN, kN, gf or kgf"]),
        ("[bench.friction]\ncoulomb = '11 V'", ["coulomb", "'11 V'"]),
        ("[bench.heat]\nlatent = '20 degC'", ["latent", "difference"]),
        ("[bench]\nshare = '5 mm'", ["share", "plain number"]),
        ("length = 1400", ["length", "counts"]),
        ("length = '1400.5 counts'", ["length", "whole number"]),
        ("seed = 1.5", ["seed", "whole number"]),
        # NaN and infinity
        ("[bench]\nshare = nan", ["share", "nan"]),
        ("[bench]\nshare = inf", ["share", "inf"]),
        ("[bench]\nload = 'nan N'", ["load", "finite"]),
        # bounds, in the unit a person reads
        ("[bench.friction]\ncoulomb = '-1 N'", ["'-1 N'", "from 0 N to 100 N"]),
        ("[bench.friction]\nripple = '0 mm'", ["'0 mm'", "above zero"]),
        ("[bench.heat]\nstop = '6 mm'", ["'6 mm'", "above zero and at most 5 mm"]),
        ("[bench.heat]\nambient = '61 degC'", ["from -20 degC to 60 degC"]),
        ("[bench]\nshare = 1.5", ["'1.5'", "from 0 to 1"]),
        ("seed = -1", ["'-1'", "0 or more"]),
        # types
        ("fan = 1", ["fan", "true or false"]),
        ("fan = 'true'", ["fan", "true or false"]),
        ("seed = true", ["seed", "True"]),
        ("seed = 0x" + "f" * 5000, ["seed", "very long"]),
        ("law = 'pi'", ["law", "'pd' or 'pid'"]),
        ("law = ['pd']", ["law", "'pd' or 'pid'"]),
        ("label = 3", ["label", "text"]),
        (f"label = '{'x' * 101}'", ["label", "100 characters"]),
        ("[bench]\nload = ['1 N']", ["load", "unit"]),
        ("[bench]\nload = 2001-01-01", ["load", "2001-01-01"]),
        # lists
        ("[bench.heat]\nmap_volts = ['1 V']", ["map_volts", "two values or more"]),
        ("[bench.heat]\nmap_volts = '1 V'", ["map_volts", "a list"]),
        ("[bench.heat]\nmap_volts = ['1 V', '6 V']", ["map_volts, item 2", "5000 mV"]),
        ("[bench.heat]\nmap_volts = ['1 V', 2]", ["map_volts, item 2", "unit"]),
        # what the sets themselves refuse
        ("[bench.heat]\nstop = '4.5 mm'", ["bench.heat.stop", "4.5 mm", "at most the stroke"]),
        ("[bench]\nload = '2 N'", ["bench.load", "heavy", "under 1 N"]),
        # the file
        ("", ["the file is empty"]),
        ("# nothing\n", ["sets no parameter"]),
        ("[bench.heat]\n", ["sets no parameter"]),
        ("a = = 1", ["TOML", "line 1"]),
        (b"label = '\xff'", ["0xff at offset 9"]),
    ],
)
def test_wrong_settings(tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    message = refused(tmp_path, text)
    for word in words:
        assert word in message


def test_wrong_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is a folder"):
        load_overrides(tmp_path, Toy())
    with pytest.raises(InputError, match="no such file"):
        load_overrides(tmp_path / "none.toml", Toy())
    (tmp_path / "a.csv").write_text("seed = 1")
    with pytest.raises(InputError, match=r"suffix is \.csv"):
        load_overrides(tmp_path / "a.csv", Toy())


@pytest.mark.parametrize(
    ("own", "included", "words"),
    [
        ("seed = 1", "[bench.heat]\nstop = '9 mm'", "part.toml, bench.heat.stop: '9 mm'"),
        ("seed = 1", "[bench.heat]\nstroke = '1 mm'", "part.toml, bench.heat.stop: '3.98 mm'"),
        ("seed = 1", "[bench.heat]\nstops = '1 mm'", "part.toml, bench.heat.stops"),
        ("bench.heat.stop = '9 mm'", "[bench.heat]\nstop = '1 mm'", "own.toml, bench.heat.stop"),
        ("seed = -1", "[bench.heat]\nstop = '1 mm'", "own.toml, seed"),
    ],
)
def test_a_bad_value_names_the_file_that_says_it(
    tmp_path: Path, own: str, included: str, words: str
) -> None:
    (tmp_path / "part.toml").write_text(included, encoding="utf-8")
    file = tmp_path / "own.toml"
    file.write_text(f'include = "part.toml"\n{own}\n', encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_overrides(file, Toy())
    assert str(caught.value).startswith(f"{tmp_path}/{words}")


class Derived(NamedTuple):
    mass: Annotated[float, Par("kg", "mass", positive=True)] = 2.0
    force: Annotated[float, Par("N", "force", positive=True)] = 4.0
    acceleration: Annotated[float, Par("m/s^2", "what follows", positive=True)] = 2.0
    time: Annotated[float, Par("s", "what follows from that", positive=True)] = 0.5

    def derived(self) -> tuple[tuple[str, Callable[[Any], float]], ...]:
        return (
            ("acceleration", lambda tree: tree.force / tree.mass),
            ("time", lambda tree: 1.0 / tree.acceleration),
        )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('mass = "1e300 kg"\nforce = "1e-300 N"\n', ["a.toml, time", "follows"]),
        (
            'mass = "1e300 kg"\nforce = "1e-300 N"\ntime = "1 s"\n',
            ["a.toml, acceleration", "0 m/s^2", "above zero"],
        ),
    ],
)
def test_a_value_that_follows_beyond_its_bounds_is_refused_by_file_and_key(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(InputError) as refused:
        load_overrides(tmp_path / "a.toml", Derived())
    for word in words:
        assert word in str(refused.value)


def test_inner_sets_are_checked_before_outer_ones() -> None:
    bad = Toy(Bench(Heat(stop=4.5e-3), load=2.0))
    with pytest.raises(InputError, match=r"defaults, bench\.heat\.stop"):
        check(bad, "defaults")
    check(Toy(), "defaults")


def test_shown_as_toml_with_meaning_and_source() -> None:
    text = as_toml(Toy())
    assert text.startswith(f"seed = {2**63 - 1}  # seed (bench assumption)\n")
    assert 'coulomb = "9 N"  # kinetic level (Section 4.2)' in text
    assert 'stop = "3.98 mm"  # ' in text
    assert 'load = "30 gf"  # ' in text
    assert 'map_volts = ["1250 mV", "1300 mV", "5000 mV"]  # ' in text
    assert "share = 0.014  # " in text
    assert 'part = "30 %"  # ' in text
    assert "fan = false  # " in text
    assert "# not set: unset = nan  # " in text
    assert "hidden" not in text
    assert text.index("[bench.heat]") < text.index("[bench.friction]")  # the tree's order
    assert text.index("[bench]") < text.index("share")


def test_a_part_of_the_tree() -> None:
    text = as_toml(Toy(), "bench.friction")
    assert text.splitlines()[0] == "[bench.friction]"
    assert len(text.splitlines()) == 3
    assert as_toml(Toy(), "bench.load").startswith('[bench]\nload = "30 gf"')
    assert len(as_toml(Toy(), "bench").splitlines()) > len(text.splitlines())
    for wrong in ("bench.frict", "benc", "bench.friction.x", "", "."):
        with pytest.raises(InputError, match="config show"):
            as_toml(Toy(), wrong)


NUMBER = st.floats(min_value=1e-30, max_value=1e30)
TREES = st.builds(
    Toy,
    st.builds(
        Bench,
        st.builds(
            Heat,
            st.floats(-20.0, 60.0),
            st.floats(allow_nan=False, allow_infinity=False),
            st.floats(1e-6, 3e-3),
            st.floats(4e-3, 1.0),
            st.lists(st.floats(0.0, 5.0), min_size=2, max_size=6).map(tuple),
        ),
        st.builds(Friction, st.floats(0.0, 100.0), NUMBER),
        st.floats(0.0, 1.0),
        st.floats(0.0, 1.0),
        st.floats(0.0, 1.0),
    ),
    st.integers(0, 2**63 - 1),
    st.integers(-(2**31), 2**31),
    st.booleans(),
    st.sampled_from(["pd", "pid"]),
    st.text(st.characters(codec="utf-8"), max_size=50).filter(str.isprintable),
    st.just(math.nan),
    st.just(1.0),
)


@given(TREES)
@example(Toy(label='a\\b "c" \\"'))  # and the default's seed, which no float holds
@settings(max_examples=50)
def test_what_is_shown_reads_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, tree: Toy
) -> None:
    file = tmp_path_factory.getbasetemp() / "tree.toml"
    file.write_text(as_toml(tree), encoding="utf-8")
    # A tuple may have another length than the default, so the default is the target's shape.
    again = load_overrides(file, Toy())
    written = [(e.path, e.value) for e in entries(tree) if e.path != "unset"]
    assert [(e.path, e.value) for e in entries(again) if e.path != "unset"] == written
    assert difference(again, tree) == {}


@given(st.text(max_size=80))
@settings(max_examples=100)
def test_any_text_is_settings_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.toml"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    with suppress(InputError):
        load_overrides(file, Toy())
