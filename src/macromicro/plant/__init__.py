"""The virtual bench: what is physically there. It knows no model and no controller."""

# Source of what no model of this package has, and the default bench has none of.
VARIANT = "a variant: docs/variants.md"
