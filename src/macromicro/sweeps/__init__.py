"""Sweeps: many variants of a batch job, over processes or a cluster, that survive a kill.

Variants are computed in parts. A finished part is a Parquet file; what is missing is what is left
to do.
"""
