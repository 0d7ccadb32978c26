"""A microcontroller board that holds the loop, and its protocol (docs/firmware.md)."""
