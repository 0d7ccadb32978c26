"""The live machine: requests in, motions out, every transition reported."""
