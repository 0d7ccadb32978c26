"""Icons of static characteristics: output over input, both from -1 to 1."""

from __future__ import annotations

Points = tuple[tuple[float, float], ...]

WIDTH, HEIGHT = 40.0, 30.0

# Each icon: whether it has axes, and its strokes.
ICONS: dict[str, tuple[bool, tuple[Points, ...]]] = {
    "saturation": (True, (((-1, -0.7), (-0.5, -0.7), (0.5, 0.7), (1, 0.7)),)),
    "dead zone": (True, (((-1, -0.9), (-0.4, 0), (0.4, 0), (1, 0.9)),)),
    "inverse": (True, (((-1, -0.95), (0, -0.4), (0, 0.4), (1, 0.95)),)),
    "jump zone": (
        True,
        (((-1, -0.95), (-0.45, -0.45), (-0.45, 0), (0.45, 0), (0.45, 0.45), (1, 0.95)),),
    ),
    "sign": (True, (((-1, -0.65), (0, -0.65), (0, 0.65), (1, 0.65)),)),
    "relay": (
        True,
        (((-1, -0.7), (0.35, -0.7), (0.35, 0.7), (1, 0.7)), ((-0.35, 0.7), (-0.35, -0.7))),
    ),
    "quantiser": (
        True,
        (
            (
                *((-1, -0.8), (-0.5, -0.8), (-0.5, -0.25), (0, -0.25)),
                *((0, 0.3), (0.5, 0.3), (0.5, 0.85), (1, 0.85)),
            ),
        ),
    ),
    "hysteresis": (
        True,
        (
            ((-1, -0.8), (-0.1, -0.75), (0.15, -0.55), (0.5, 0.55), (0.7, 0.75), (1, 0.8)),
            ((1, 0.8), (0.1, 0.75), (-0.15, 0.55), (-0.5, -0.55), (-0.7, -0.75), (-1, -0.8)),
        ),
    ),
    "switch": (False, (((-1, 0), (-0.4, 0), (0.4, 0.6)), ((0.4, 0), (1, 0)))),
}


def icon_elements(name: str, x: float, y: float) -> list[str]:
    axes, strokes = ICONS[name]
    made = []
    if axes:
        left, top = x - 0.5 * WIDTH, y - 0.5 * HEIGHT
        made.append(
            f'<path d="M{left:.1f} {y:.1f}h{WIDTH:g}M{x:.1f} {top:.1f}v{HEIGHT:g}" '
            'stroke-width="0.7" opacity="0.55"/>'
        )
    for stroke in strokes:
        places = [(x + 0.5 * WIDTH * a, y - 0.5 * HEIGHT * b) for a, b in stroke]
        path = "L".join(f"{a:.1f} {b:.1f}" for a, b in places)
        made.append(f'<path d="M{path}" stroke-width="1.9"/>')
    return made
