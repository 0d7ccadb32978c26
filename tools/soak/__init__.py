"""A server on a faulty rig, driven at random for as long as wanted: does it ever surprise?

``PYTHONPATH=tools python -m soak --kind each --minutes 60 --seed 1 --out results/soak.md``
"""
