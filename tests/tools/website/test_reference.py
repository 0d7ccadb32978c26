"""The reference: each public name once, by its home."""

from __future__ import annotations

from macromicro.plant.encoder import Encoder
from website import docstrings, reference


def test_a_name_is_shown_once() -> None:
    """`Everett` at the front door of its package, and not again in its module."""
    found = reference.documented()
    assert found["macromicro.hysteresis.everett.Everett"].name == "macromicro.hysteresis.Everett"
    page = next(page for page in reference.PAGES if page.name == "hysteresis")
    text = reference.text(page)
    assert ".. autoclass:: macromicro.hysteresis.Everett\n   :members:" in text
    assert "macromicro.hysteresis.everett.Everett" not in text
    assert ".. autofunction:: macromicro.hysteresis.prandtl.play\n" in text


def test_the_front_door_is_shown_whole() -> None:
    names = [named.name for named in reference.public("macromicro")]
    assert {"macromicro.run", "macromicro.connect", "macromicro.Settings"} <= set(names)
    kinds = {named.name: named.kind for named in reference.public("macromicro")}
    assert kinds["macromicro.InputError"] == "exception"
    assert (kinds["macromicro.run"], kinds["macromicro.Recording"]) == ("function", "class")


def test_parameters_are_listed_with_unit_and_meaning() -> None:
    lines = docstrings.fields(Encoder)
    k = next(k for k, line in enumerate(lines) if line.startswith("``pitch``"))
    assert lines[k].endswith(" um") and lines[k + 1].startswith("    ") and "(" in lines[k + 1]
    assert docstrings.fields(tuple) == []


def test_docstrings_mean_what_they_say() -> None:
    """No list that begins at V, no substitution of |v|, no type torn apart."""
    assert docstrings.escaped("    V.") == "    \\V."
    assert docstrings.escaped("with |v| above 0") == "with \\|v\\| above 0"
    assert docstrings.escaped("p : int | None") == "p : int | None"
    assert docstrings.escaped("some `Recording`s") == "some `Recording`\\ s"
    assert docstrings.escaped("``|x|``") == "``|x|``"
    assert docstrings.literal(["As:", "", "    a = 1"]) == ["As:", "", "::", "", "    a = 1"]
