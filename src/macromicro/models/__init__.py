"""The thesis' models (4.2)-(4.5), (5.2)-(5.9), as fitted to a bench."""
