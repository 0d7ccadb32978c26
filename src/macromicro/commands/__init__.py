"""Commands of the command line beyond a run: `identify` and `collect`."""
