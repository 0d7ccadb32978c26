"""The live server: the control process and the protocols that talk to it."""
