"""The thesis' procedures, carried out on the virtual bench: each gives its figures."""
