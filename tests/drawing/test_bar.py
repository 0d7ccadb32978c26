"""The bar on stderr."""

from __future__ import annotations

from macromicro.drawing.bar import progress_bar


def test_it_shows_share_and_description_on_stderr_and_goes() -> None:
    with progress_bar() as bar:
        task = bar.add_task("[one] left", total=4.0)
        bar.update(task, advance=1.0)
        assert bar.console.stderr
        assert bar.tasks[0].percentage == 25.0
        texts = [column.render(bar.tasks[0]) for column in (bar.columns[0], bar.columns[2])]
        assert [str(text).strip() for text in texts] == ["25 %", "[one] left"]
    assert bar.live.transient
