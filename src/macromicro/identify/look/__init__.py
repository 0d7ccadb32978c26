"""Contents of a measured file: columns, time, and the command to continue with."""
