"""Runs: a programme or a drive on the virtual bench or on a rig, in memory or into a folder."""
