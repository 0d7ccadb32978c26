from xml.etree import ElementTree

import pytest

from macromicro.drawing import _symbols


def test_scripts_minus_and_prime() -> None:
    assert _symbols.plain("K_{aw} z^{-1} - V'_d") == "Kaw z\u22121 \u2212 V\u2032d"
    assert _symbols.plain("y~-~u, (-1)") == "y\u00a0\u2212\u00a0u, (\u22121)"
    shifts = [(run.text, run.shift > 0.0) for run in _symbols.runs("T_d") if run.shift]
    assert shifts == [("d", True)]


def test_hyphens_stay() -> None:
    assert _symbols.plain("micro-stage, electro-") == "micro-stage, electro-"


def test_after_a_script_the_text_is_back_on_its_line() -> None:
    element = ElementTree.fromstring(_symbols.text_element(0.0, 0.0, "a_b + c^2 d"))
    assert sum(float(span.get("dy", 0.0)) for span in element) == pytest.approx(0.0)


def test_text_is_escaped() -> None:
    element = ElementTree.fromstring(_symbols.text_element(0.0, 0.0, 'a < b & "c"'))
    assert "".join(element.itertext()) == 'a < b & "c"'


def test_a_fraction_is_as_wide_as_its_wider_half_and_higher_than_a_line() -> None:
    assert _symbols.width("1//z + a") > _symbols.width("z + a") > _symbols.width("1")
    assert _symbols.height("1//z + a") > 2.0 * _symbols.height("1") - 1.0


# Set in DejaVu Sans, of the faces that a page is likely to use the widest.
@pytest.mark.parametrize(
    "text",
    ["anti-windup", "0.0124593 z - 0.0112178", "Hall sensor,", "CTRL", "WMQ", "1.3 to 1.9 V"],
)
def test_no_text_comes_out_wider_than_measured(text: str) -> None:
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), _symbols.plain(text), _symbols.FONT, prop=FontProperties("DejaVu Sans"))
    box = path.get_extents()
    assert _symbols.width(text) >= box.width
