"""A server on the faulty twin, driven at random for as long as wanted: does it ever surprise?

``PYTHONPATH=tools python -m soak --minutes 60 --seed 1 --out docs/reliability.md``
"""
