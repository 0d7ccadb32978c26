"""What an engineer fits to a bench: the thesis' models (4.2)-(4.5), (5.2)-(5.9)."""
