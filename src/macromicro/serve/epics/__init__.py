"""EPICS Channel Access: the machine as motor records."""
