"""Terminal control of a carriage: full effort, then to rest at the target with the belt at rest.

`model`: what the law believes of the carriage; `estimate`: where it is, from whole counts;
`landing`: the efforts of least energy that end at rest; `law`: when which of them acts.
"""
