"""The virtual bench: the physics, without models or controllers."""

# Source of what no model of this package has, and the default bench has none of.
VARIANT = "a variant: docs/validation/beyond.md"
