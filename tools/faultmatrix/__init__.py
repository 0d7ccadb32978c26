"""Every kind of machine, every fault, every mode: what stops it, and is its position still right?

``PYTHONPATH=tools python -m faultmatrix --out results/matrix.md``
"""
