"""Python functions that C lacks, with Python's results for every number."""

from __future__ import annotations

NAMES = {
    "min": "min_of",
    "max": "max_of",
    "min_int": "min_of_int",
    "max_int": "max_of_int",
    "abs_int": "abs_of_int",
    "whole": "whole",
    "floor_quotient": "floor_quotient",
    "floor_remainder": "floor_remainder",
    "floor_quotient_int": "floor_quotient_int",
    "floor_remainder_int": "floor_remainder_int",
}

TEXT = {
    "min": """\
/* The smaller of two; the first where they are equal or one is NaN. */
static inline real min_of(real a, real b) { return b < a ? b : a; }""",
    "max": """\
/* The larger of two; the first where they are equal or one is NaN. */
static inline real max_of(real a, real b) { return b > a ? b : a; }""",
    "min_int": "static inline integer min_of_int(integer a, integer b) { return b < a ? b : a; }",
    "max_int": "static inline integer max_of_int(integer a, integer b) { return b > a ? b : a; }",
    "abs_int": "static inline integer abs_of_int(integer a) { return a < 0 ? -a : a; }",
    "whole": """\
/* A number without its fraction; the nearest end of the integers beyond them, 0 for NaN. */
static inline integer whole(real x)
{
    if (!(x > INTEGER_LOW)) {
        return x <= INTEGER_LOW ? INTEGER_MIN : 0;
    }
    return x < INTEGER_HIGH ? (integer)x : INTEGER_MAX;
}""",
    "floor_remainder": """\
/* What is left after floor_quotient; it has the sign of b. */
static inline real floor_remainder(real a, real b)
{
    const real left = FMOD(a, b);
    if (left == 0) {
        return COPYSIGN(0, b);
    }
    return (b < 0) != (left < 0) ? left + b : left;
}""",
    "floor_quotient": """\
/* The quotient, rounded down. */
static inline real floor_quotient(real a, real b)
{
    const real left = FMOD(a, b);
    real quotient = (a - left) / b;
    if (left != 0 && (b < 0) != (left < 0)) {
        quotient -= 1;
    }
    if (quotient == 0) {
        return COPYSIGN(0, a / b);
    }
    const real down = FLOOR(quotient);
    return quotient - down > (real)0.5 ? down + 1 : down;
}""",
    "floor_quotient_int": """\
/* The quotient, rounded down; 0 of a division by 0. */
static inline integer floor_quotient_int(integer a, integer b)
{
    if (b == 0) {
        return 0;
    }
    return a / b - (a % b != 0 && (a % b < 0) != (b < 0));
}""",
    "floor_remainder_int": """\
/* What is left after floor_quotient_int; it has the sign of b. */
static inline integer floor_remainder_int(integer a, integer b)
{
    if (b == 0) {
        return 0;
    }
    return a % b + (a % b != 0 && (a % b < 0) != (b < 0) ? b : 0);
}""",
}


def lines(used: set[str], single: bool) -> list[str]:
    suffix = "f" if single else ""
    swap = {
        "INTEGER_LOW": "-2147483648.0f" if single else "-9223372036854775808.0",
        "INTEGER_HIGH": "2147483648.0f" if single else "9223372036854775808.0",
        "INTEGER_MIN": "INT32_MIN" if single else "INT64_MIN",
        "INTEGER_MAX": "INT32_MAX" if single else "INT64_MAX",
        "FMOD": f"fmod{suffix}",
        "COPYSIGN": f"copysign{suffix}",
        "FLOOR": f"floor{suffix}",
        "integer": "int32_t" if single else "int64_t",
        "real": "float" if single else "double",
    }
    found: list[str] = []
    for name in [each for each in TEXT if each in used]:
        text = TEXT[name]
        for word, put in swap.items():
            # The words of comments stay.
            text = "\n".join(
                line if line.lstrip().startswith("/*") else line.replace(word, put)
                for line in text.splitlines()
            )
        found += ["", *text.splitlines()]
    return found[1:]
