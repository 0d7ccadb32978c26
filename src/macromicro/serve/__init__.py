"""The positioner live: a process that does nothing but control, and what talks to it."""
