"""Sweeps: many variants of a batch job, over processes or a cluster, that survive a kill.

The spec and an index define a variant's parameters. Finished variants go to a journal at
once, and from there in order to a Parquet file.
"""
