"""Writes docs/examples.md and its pictures: twenty commands, each run here.

python docs/make_examples.py [--quick: the first example, nothing is written]
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "examples.md"
PICTURES = ROOT / "docs" / "figures" / "examples"
HEAD = """\
# Examples

Twenty commands and what they draw. Run them in a folder that contains `examples/`
(`macromicro examples` copies it); each writes to `results/`. `docs/make_examples.py`
generates this page and its pictures.

Longer examples are the [tutorials](index.md#tutorials) and notebooks.
"""


class Example(NamedTuple):
    """One example."""

    title: str
    about: str
    commands: tuple[str, ...]
    picture: str  # below results/


EXAMPLES = (
    Example(
        "The thesis' integrated test",
        "Eight moves of the carriage, each followed by four set points of the micro-stage.",
        ("run thesis --out results/thesis",),
        "thesis/response.png",
    ),
    Example(
        "Vibration after a move",
        "The belt swings after the carriage has stopped; the laser sees it.",
        ("run full-travel --out results/travel",),
        "travel/vibration.png",
    ),
    Example(
        "Steps of the micro-stage",
        "A shape-memory actuator contracts quickly and extends as it cools.",
        ("run staircase --out results/stairs",),
        "stairs/micro.png",
    ),
    Example(
        "Two pairs of laws",
        "The same moves under the thesis' laws and under `terminal` and `inverse`.",
        (
            "run fast --law pd-tuned,pi-antiwindup --out results/laws/thesis",
            "run fast --law terminal,inverse --out results/laws/own",
            "compare results/laws/thesis results/laws/own --out results/laws/compare",
        ),
        "laws/compare/overlay.png",
    ),
    Example(
        "An axis from its data sheet",
        "A maxon motor on a fine screw, a scale of 0.1 um; gains are derived.",
        ("run --config examples/machines/stage.toml --out results/stage",),
        "stage/moves.png",
    ),
    Example(
        "A screw that lifts a load",
        "The encoder is on the motor and does not see 4 um of backlash.",
        ("run --config examples/machines/screw.toml --out results/screw",),
        "screw/response.png",
    ),
    Example(
        "A servo turns a disc",
        "A rotary axis with a gear of 70 and an encoder at the load.",
        ("run --config examples/machines/servo.toml --out results/servo",),
        "servo/moves.png",
    ),
    Example(
        "A piezo stage",
        "100 um with hysteresis, creep and a resonance, in moves of some 50 ms.",
        ("run --config examples/machines/piezo-100um.toml --out results/piezo",),
        "piezo/response.png",
    ),
    Example(
        "A shape-memory wire",
        "0.15 mm of Flexinol against a spring, 3.3 mm of contraction.",
        ("run --config examples/machines/wire-150um.toml --out results/wire",),
        "wire/response.png",
    ),
    Example(
        "Two axes in the plane",
        "A square, a circle and a diagonal; the contour error is magnified.",
        ("run --config examples/machines/xy-plotter.toml --out results/plotter",),
        "plotter/path.png",
    ),
    Example(
        "Three stages on one clock",
        "Two axes and a piezo that start and end each move together.",
        ("run --config examples/machines/xyz.toml --out results/three",),
        "three/axes.png",
    ),
    Example(
        "Mass and friction from strokes",
        "Strokes at five voltages, and the identified model's free simulation.",
        (
            "collect drive --config examples/machines/emps.toml --out results/strokes",
            "identify drive results/strokes/drive.h5 --out results/drive",
        ),
        "drive/free_run.png",
    ),
    Example(
        "A piezo's hysteresis",
        "Play operators from slow ramps; the last 30 % are predicted.",
        (
            "collect plays --config examples/machines/piezo-100um.toml --out results/ramps",
            "identify plays results/ramps/plays.h5 --out results/loop",
        ),
        "loop/curves.png",
    ),
    Example(
        "A Preisach density",
        "First-order reversal curves of nanowires (`examples/data/forc`).",
        ("identify hysteresis examples/data/forc/hchb_forc --out results/forc",),
        "forc/density.png",
    ),
    Example(
        "An unknown stage",
        "Commissioning from the stage's own sensor: its strokes and the fitted model.",
        ("commission --config examples/machines/stage.toml --out results/found",),
        "found/strokes.png",
    ),
    Example(
        "Better gains",
        "A search on the model, and the open loop before and after.",
        ("tune axis --config examples/machines/printer.toml --objective error --evaluations 120 "
         "--out results/gains",),
        "gains/bode.png",
    ),
    Example(
        "Machines that differ",
        "Which parameter matters most, one at a time.",
        ("robust --config examples/machines/stage.toml --samples 100 --out results/robust",),
        "robust/tornado.png",
    ),
    Example(
        "A measured Bode plot",
        "Plant and open loop under the law, while the stage travels.",
        ("response --config examples/machines/stage.toml --out results/bode",),
        "bode/bode.png",
    ),
    Example(
        "A map of 1600 gains",
        "Settling and overshoot over the two taps of the thesis' controller.",
        ("sweep examples/sweep-gains.toml --out results/map",),
        "map/sweep.png",
    ),
    Example(
        "A figure of the thesis",
        "Figure 4.8, measured again by the thesis' procedure.",
        ('reproduce --only "Figure 4.8" --out results/claim',),
        "claim/figures/figure-4-8.png",
    ),
)  # fmt: skip


def render() -> str:
    """The page."""
    return HEAD + "".join(_section(k, each) for k, each in enumerate(EXAMPLES, 1)) + machines()


def machines() -> str:
    """The machine files by their first line."""
    link = "[How they move](validation/machines.md)"
    head = f"\n## Machine files\n\nEach file names its data sheets. {link}."
    rows = "".join(
        f"| [`{path.name}`](../examples/machines/{path.name}) | {_first(path)} |\n"
        for path in sorted((ROOT / "examples" / "machines").glob("*.toml"))
    )
    return f"{head}\n\n| file | machine |\n|---|---|\n{rows}"


def _first(path: Path) -> str:
    return path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")


def _section(number: int, example: Example) -> str:
    lines = "\n".join(f"    macromicro {command}" for command in example.commands)
    picture = f"![{example.title}](figures/examples/{_name(number)})"
    return f"\n## {number}. {example.title}\n\n{example.about}\n\n{lines}\n\n{picture}\n"


def _name(number: int) -> str:
    return f"{number:02d}.png"


def run(example: Example, folder: Path) -> Path:
    """Run an example's commands in a folder; the picture that they draw."""
    for command in example.commands:
        words = [sys.executable, "-m", "macromicro", *shlex.split(command)]
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    return folder / "results" / example.picture


def main() -> None:
    """Run every example, keep its picture and write the page."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        if "--quick" in sys.argv:
            assert run(EXAMPLES[0], folder).is_file()
            return
        PICTURES.mkdir(parents=True, exist_ok=True)
        for number, example in enumerate(EXAMPLES, 1):
            shutil.copyfile(run(example, folder), PICTURES / _name(number))
    PAGE.write_text(render(), encoding="utf-8")


if __name__ == "__main__":
    main()
