"""The firmware's generated C: protocol, pins and parameters, and the exported control."""
