"""Chapter 3: flexure, magnets and Hall sensor."""
