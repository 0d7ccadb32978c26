"""The documentation's site: settings of Sphinx and what it lacks. `make site` builds it."""
