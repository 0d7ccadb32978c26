"""Random orders and injuries for the simulated board, and a judge of what its pins put out."""
