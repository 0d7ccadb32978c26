"""What a file of measured data holds: its columns (`columns`), its time (`timing`), and which
command goes on with it (`onward`); `told` puts them together.
"""
