"""Appendix C: channels of the rig."""
