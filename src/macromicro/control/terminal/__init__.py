"""Terminal control of a carriage: full effort, then to rest at the target with the belt at rest."""
