/* A programme without a law. */
#define START(x) (void)(x)
#define STEP(a, x, t) effort = (a) - (x) + (t)
