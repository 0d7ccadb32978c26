"""A microcontroller board that holds the loop, and the protocol that it speaks (docs/firmware.md)."""
