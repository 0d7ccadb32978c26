"""What "module:object" names, and what is said where there is no such thing."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from macromicro.errors import InputError
from macromicro.schema import plugins

MODULE = """
from math import pi, sqrt
def bench(seed): pass
def oven(seed): pass
_hidden = 3
number = 5
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module in the working directory, by a name of this test's own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"lab_{tmp_path.name.replace('-', '_')}"
    (tmp_path / f"{name}.py").write_text(MODULE)
    return name


@pytest.mark.parametrize(
    ("name", "good"),
    [("a:b", True), ("a.b:c", True), ("a", False), ("a:", False), (":b", False), ("", False),
     ("a:b()", False), ("a b:c", False), ("a..b:c", False), ("os;x:y", False)],
)  # fmt: skip
def test_how_a_name_is_spelled(name: str, good: bool) -> None:
    assert plugins.is_plugin_name(name) is good


def test_it_is_found_where_the_user_stands(module: str) -> None:
    assert plugins.load(f"{module}:number", "x", "a number", callable) == 5


@pytest.mark.parametrize(
    ("name", "said"),
    [("{m}:ovn", "no ovn in .*. Expected: a rig of {m}, such as oven"),
     ("{m}:x", "such as bench"),  # the first, neither imported nor hidden
     ("{m}_:x", "no module {m}_"),
     ("{m}.inner:x", "no module {m}.inner")],
)  # fmt: skip
def test_what_is_missing_is_said_with_the_nearest(module: str, name: str, said: str) -> None:
    with pytest.raises(InputError, match="--rig.*" + said.format(m=module)):
        plugins.load(name.format(m=module), "--rig", "a rig", callable)


@pytest.mark.parametrize(
    ("text", "said"),
    [("import no_such_thing", "no module no_such_thing, which {m} imports"),
     ("1 / 0", "importing {m} failed: ZeroDivisionError: division by zero"),
     ("def x(:", "importing {m} failed: SyntaxError"),
     ("from math import nothing", "importing {m} failed: ImportError")],
)  # fmt: skip
def test_errors_while_it_is_imported_are_told(module: str, text: str, said: str) -> None:
    Path(f"{module}.py").write_text(text)
    with pytest.raises(InputError, match="--law.*" + said.format(m=module)):
        plugins.load(f"{module}:x", "--law", "a law", callable)


def test_entry_points_are_listed_by_group() -> None:
    assert plugins.entry_points("macromicro.laws") == {}
    assert plugins.entry_points("console_scripts")["macromicro"] == "macromicro.__main__:main"


def test_a_name_stands_for_a_place() -> None:
    assert plugins.place("mylab.laws:it", "console_scripts") == "mylab.laws:it"
    assert plugins.place("macromicro", "console_scripts") == "macromicro.__main__:main"
    assert plugins.place("macromicro", "macromicro.laws") is None
    assert plugins.place("", "console_scripts") is None


@pytest.mark.parametrize(
    ("name", "said"),
    [("{m}:number", "x: '{m}:number, int'; accepted: a builtins.str"),
     ("{m}", "x: '{m}'; accepted: one of macromicro; or MODULE:WORD"),
     (3, "x: '3'; accepted: one of")],
)  # fmt: skip
def test_a_group_finds_its_own(module: str, name: object, said: str) -> None:
    group = plugins.Group("console_scripts", "a word", str, "MODULE:WORD", ("macromicro",))
    Path(f"{module}.py").write_text("word, number = 'yes', 5\n")
    assert group.find(f"{module}:word", "x") == "yes"
    given = name.format(m=module) if isinstance(name, str) else name
    with pytest.raises(InputError, match=said.format(m=module)):
        group._replace(name="macromicro.laws").find(given, "x")
