"""The board's very binary in simavr, its pins coupled in lockstep to the virtual bench."""
