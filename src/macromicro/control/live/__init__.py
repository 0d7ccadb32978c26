"""The positioner as a live machine: requests in, motions out, every transition reported."""
