/* Python's functions that C lacks, with Python's results for every number. */

/* The smaller of two; the first where they are equal or one is NaN. */
static inline real min_of(real a, real b) { return b < a ? b : a; }

/* The larger of two; the first where they are equal or one is NaN. */
static inline real max_of(real a, real b) { return b > a ? b : a; }

static inline integer min_of_int(integer a, integer b) { return b < a ? b : a; }

static inline integer max_of_int(integer a, integer b) { return b > a ? b : a; }

static inline integer abs_of_int(integer a) { return a < 0 ? -a : a; }

/* A number without its fraction; the nearest end of the integers beyond them, 0 for NaN. */
static inline integer whole(real x)
{
    if (!(x > -INTEGER_LIMIT)) {
        return x <= -INTEGER_LIMIT ? INTEGER_MIN : 0;
    }
    return x < INTEGER_LIMIT ? (integer)x : INTEGER_MAX;
}

/* What is left after floor_quotient; it has the sign of b. */
static inline real floor_remainder(real a, real b)
{
    const real left = FMOD(a, b);
    if (left == 0) {
        return COPYSIGN(0, b);
    }
    return (b < 0) != (left < 0) ? left + b : left;
}

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
}

/* The quotient, rounded down; 0 of a division by 0. */
static inline integer floor_quotient_int(integer a, integer b)
{
    if (b == 0) {
        return 0;
    }
    return a / b - (a % b != 0 && (a % b < 0) != (b < 0));
}

/* What is left after floor_quotient_int; it has the sign of b. */
static inline integer floor_remainder_int(integer a, integer b)
{
    if (b == 0) {
        return 0;
    }
    return a % b + (a % b != 0 && (a % b < 0) != (b < 0) ? b : 0);
}
