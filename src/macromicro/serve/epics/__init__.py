"""EPICS Channel Access: the machine as motor records, with its state and traces beside them."""
