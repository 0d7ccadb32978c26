"""Shared TCP front end: check of the first line, rate and size limits, keep-alive, lost clients."""
