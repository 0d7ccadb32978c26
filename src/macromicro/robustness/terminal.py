"""A study in the terminal: yields, influences and worst cases."""

from __future__ import annotations

from macromicro.drawing.console import add_row, table, terminal
from macromicro.robustness import words
from macromicro.robustness._findings import overall, worst
from macromicro.robustness.study import Study
from macromicro.robustness.words import About


def show(study: Study, about: About, out: str) -> None:
    from rich.text import Text

    console = terminal()

    def say(text: str, style: str = "") -> None:
        console.print(Text(text, style=style), soft_wrap=True)

    for remark in words.remarks(study):
        say(remark, "bold red")
    say(f"{about.title}: {len(study.rows)} machines, seed {study.request.seed}")
    shown = table(words.YIELD_HEADINGS, left=2)
    for row in words.yield_rows(study, overall(study)):
        add_row(shown, row)
    console.print(shown)
    console.print()
    say("largest influences, one parameter at a time:")
    for name in study.subject.main:
        say(f"  {study.metric(name).meaning}: {words.influence(study, name)}")
    console.print()
    say("worst cases, and how to repeat them:")
    for found in worst(study):
        metric = found.requirement.metric
        say(f"  {metric.meaning}: {words.worst_value(study, found)}, sample {found.sample}")
        say(f"    {words.replay(study, found, about, out)}")
