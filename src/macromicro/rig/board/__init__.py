"""A microcontroller board that closes the loop, and its protocol (docs/board.md)."""
