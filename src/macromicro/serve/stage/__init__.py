"""A machine of one stage, served: what of the server is other than for the two-stage machine."""
