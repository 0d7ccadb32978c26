"""The law of a calibrated stage on the simulated Arduino gives the efforts that Python gives."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tests.firmware.built import ROOT, needs_avr

sys.path.insert(0, str(ROOT / "benchmarks"))

import cycles


@needs_avr
@pytest.mark.slow
def test_its_efforts_are_those_of_python_and_it_fits_an_uno() -> None:
    replay = cycles.corrected()
    found, greatest = replay.found, np.abs(replay.expected).max()
    assert len(replay.efforts) == len(replay.expected) == cycles.PERIODS and greatest > 1.0
    assert np.abs(replay.efforts - replay.expected).max() < 1e-4 * greatest  # in single precision
    assert found.mcu == "atmega328p" and found.ram + found.stack < 2048
