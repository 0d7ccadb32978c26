"""A machine of two axes, served: what of the server is other than for one stage."""
