"""Files that people have, as columns by name: one reader for all commands that take measured data.

`reading.read` tells the kind of a file by its content and gives a `table.Table`, whose columns are
read when they are asked for; `recordings.recording` gives the same as a `Recording`.
"""
