"""``macromicro limits``: the best that a bench's own parameters allow."""

from __future__ import annotations

from pathlib import Path

DISTANCES = ("200 mm", "100 mm", "40 mm", "10 mm", "1 mm")
PLACES = ("1 mm", "2 mm", "3 mm", "2 mm", "1 mm")


def limits(
    distances: list[str] | None = None,
    config: Path | None = None,
    micro: bool = False,
    as_json: bool = False,
) -> None:
    """Print the quickest moves that a bench allows.

    The carriage gets full effort in one direction, then in the other; the micro-stage full heat or
    none. The computation uses the bench's own parameters, which a law may not read. It shows how
    much a law leaves unused (docs/validation/beyond.md).
    """
    from macromicro.design.fine_limits import NEAR, turns
    from macromicro.design.limits import quickest
    from macromicro.report.run import as_json as to_json
    from macromicro.settings import Settings, choose
    from macromicro.units import quantity

    texts = distances or (PLACES if micro else DISTANCES)
    places = [(text, quantity(text, "m", "DISTANCE")) for text in texts]
    settings = choose(Settings(), config, None)
    wanted = [place for _, place in places]
    fine = turns(settings.bench, settings.sensors, wanted) if micro else []
    found = [] if micro else [quickest(settings.bench, settings.sensors, way) for way in wanted]
    if as_json:
        rows = [each._asdict() for each in fine] or [each._asdict() for each in found]
        print(to_json({"quickest": rows}), end="")
        return
    if micro:
        print(f"{'from':>10}  {'to':>10}  {f'to {1e6 * NEAR:.0f} um':>10}")
        for turn in fine:
            print(f"{1e3 * turn.start:>7.3f} mm  {1e3 * turn.place:>7.3f} mm  {turn.time:>8.3f} s")
        return
    print(f"{'distance':>10}  {'to one count':>12}  {'full effort':>11}")
    for (text, _), each in zip(places, found, strict=True):
        print(f"{text:>10}  {each.time:>10.3f} s  {each.full / 1e3:>9.3f} s")
