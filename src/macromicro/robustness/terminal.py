"""A study in the terminal: yields, influences and worst cases."""

from __future__ import annotations

from macromicro.drawing.console import terminal
from macromicro.robustness import words
from macromicro.robustness._findings import overall, worst
from macromicro.robustness.study import Study
from macromicro.robustness.words import About


def show(study: Study, about: About, out: str) -> None:
    from rich.table import Table
    from rich.text import Text

    console = terminal()

    def say(text: str, style: str = "") -> None:
        console.print(Text(text, style=style), soft_wrap=True)

    for remark in words.remarks(study):
        say(remark, "bold red")
    say(f"{about.title}: {len(study.rows)} machines, seed {study.request.seed}")
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for k, heading in enumerate(words.YIELD_HEADINGS):
        table.add_column(heading, justify="left" if k < 2 else "right", overflow="fold")
    for row in words.yield_rows(study, overall(study)):
        table.add_row(*(Text(cell) for cell in row))
    console.print(table)
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
