"""Sweeps: many variants of a batch job, over processes or a cluster, that survive a kill.

A spec names a job of `macromicro.batch` and the parameters to vary; an index names a
variant's parameters, so that nothing but the spec need be kept to go on. Finished variants
go to a journal at once, and from there in order to a Parquet file.
"""
