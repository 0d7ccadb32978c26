"""Tuning of control laws: a search for gains on simulated machines, judged before and after."""
