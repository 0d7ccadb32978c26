"""Laboratory procedures: each takes settings and yields a recording and what it shows."""
