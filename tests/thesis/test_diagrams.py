"""The diagrams: SVG files whose texts hold the code's own numbers."""

import inspect
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from macromicro.control.arrival import Sequence
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pi import Pi, PiAntiWindup
from macromicro.drawing.exhibit import SVG, render
from macromicro.identify import _linear
from macromicro.identify.kiln import without_spikes
from macromicro.models.macro import Linear, MacroModel
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.driver import Driver
from macromicro.thesis import diagrams
from macromicro.thesis.diagrams import DIAGRAMS, PARAMETERS, Parameters, draw

SPACE = "{http://www.w3.org/2000/svg}"


def root(number: str, parameters: Parameters = PARAMETERS) -> ElementTree.Element:
    body = draw(number, parameters).body
    assert isinstance(body, str)
    return ElementTree.fromstring(body)


def texts(number: str, parameters: Parameters = PARAMETERS) -> list[str]:
    found = root(number, parameters).iter(f"{SPACE}text")
    return ["".join(text.itertext()).replace("\N{MINUS SIGN}", "-") for text in found]


def test_each_file_is_listed_and_each_listed_number_has_a_file() -> None:
    files = Path(diagrams.__file__).parent.glob("*.svg")
    assert sorted(file.stem for file in files) == sorted(DIAGRAMS)
    with pytest.raises(KeyError):
        draw("4.4")


@pytest.mark.parametrize("number", DIAGRAMS)
def test_an_exhibit_with_title_and_caption(number: str) -> None:
    exhibit = render(number, draw(number))
    assert exhibit.kind == SVG and exhibit.number == number
    assert exhibit.title and exhibit.caption.endswith(".")
    assert root(number).findtext(f"{SPACE}title") == exhibit.title


@pytest.mark.parametrize("number", DIAGRAMS)
def test_every_name_is_replaced_and_every_id_exists(number: str) -> None:
    body = draw(number).body
    assert isinstance(body, str) and not set("{}") & set(body)
    used = re.findall(r'url\(#(\w+)\)|aria-labelledby="(\w+)"', body)
    assert {a or b for a, b in used} == {e.get("id") for e in root(number).iter()} - {None}


@pytest.mark.parametrize("number", DIAGRAMS)
def test_all_is_within_the_view(number: str) -> None:
    drawing = root(number)
    left, top, wide, high = map(float, drawing.attrib["viewBox"].split())
    assert wide <= 700.0
    places = [(float(e.attrib["x"]), float(e.attrib["y"])) for e in drawing.iter(f"{SPACE}text")]
    for rect in drawing.iter(f"{SPACE}rect"):
        x, y, w, h = (float(rect.attrib[k]) for k in ("x", "y", "width", "height"))
        places += [(x, y), (x + w, y + h)]
    assert all(left <= x <= left + wide and top <= y <= top + high for x, y in places)


CHANGED = Parameters(
    Amplifier(full_scale=10.0, supply=24.0, motor_duty=0.75, ctrl_duty=0.125),
    Driver(supply=6.0),
    MacroModel(Linear(a=-0.9, b=200.0), width=2.5, a0=0.4, delta=0.5, limit=8.0),
    PdInitial(0.002, -0.001),
    PdTuned(0.01, 0.005),
    Pi(kp=4e3, ki=1500.0, low=0.5, high=3.5),
    PiAntiWindup(kp=2e3, ki=1e4, kaw=15.0, low=1.25, high=1.75),
    Sequence(wait=1.5),
)


@pytest.mark.parametrize(
    ("number", "printed", "changed"),
    [
        ("3.1", "0 to 5 V, 20 V, 0 to 100 % duty", "0 to 10 V, 24 V, 0 to 75 % duty"),
        ("3.5", "0 to 5 V, 0 to 20 % duty, 4 V", "0 to 10 V, 0 to 12.5 % duty, 6 V"),
        ("D.2", "20 V", "24 V"),
        ("4.3", "±5 V", "±8 V"),
        ("4.5", "±5 V", "±8 V"),
        ("4.6", "±5 V", "±8 V"),
        ("4.7", "±5 V, ±3 V", "±8 V, ±2.5 V"),
        ("4.10", "±5 V, ±3 V", "±8 V, ±2.5 V"),
        (
            "4.12",
            "±5 V, 0.16572, z2 - 1.95833 z + 0.95833",
            "±8 V, 0.2, z2 - 1.9 z + 0.9",
        ),
        ("4.15", "a0 = 0.364 V, δ = 0.636", "a0 = 0.4 V, δ = 0.5"),
        ("4.16", "±3 V, a0 = 0.364 V, δ = 0.636", "±2.5 V, a0 = 0.4 V, δ = 0.5"),
        ("4.19", "0.00245865 z + 0.0000998447, 0.16572", "0.002 z - 0.001, 0.2"),
        ("4.21", "0.0124593 z - 0.0112178, δ = 0.636", "0.01 z + 0.005, δ = 0.5"),
        ("5.21", "Kp = 3, Ki = 2.25, 0 to, 5 V", "Kp = 4, Ki = 1.5, 0.5 to, 3.5 V"),
        (
            "5.24",
            "Kp = 3, Ki = 30, Kaw = 30, 1.3 to, 1.9 V",
            "Kp = 2, Ki = 10, Kaw = 15, 1.25 to, 1.75 V",
        ),
        ("6.1", "±3 V, ±5 V, wait 2 s", "±2.5 V, ±8 V, wait 1.5 s"),
    ],
)
def test_numbers_follow_the_parameters(number: str, printed: str, changed: str) -> None:
    assert set(printed.split(", ")) <= set(texts(number))
    assert set(changed.split(", ")) <= set(texts(number, CHANGED))
    assert not set(printed.split(", ")) & set(texts(number, CHANGED))


def test_numbers_of_the_flow_charts_are_the_codes_own() -> None:
    smoothing = " ".join(texts("5.4"))
    defaults = inspect.signature(without_spikes).parameters
    for name, unit in (("steepest", "degC/s"), ("window", "s"), ("longest", "s")):
        assert f"{defaults[name].default:g}\u00a0{unit}" in smoothing
    squares = " ".join(texts("4.2"))
    assert f"{_linear.MAX_ITERATIONS} iterations" in squares
    assert f"1/{1.0 / _linear._TOLERANCE:.0f} " in squares
