"""The documentation's site: pages of docs/, a reference from docstrings, built by Sphinx.

PYTHONPATH=tools python -m website [--out build/site]
"""
