"""GCS 2.0: the machine as a motion controller of that command set."""

from macromicro.serve.gcs.server import GcsServer

__all__ = ["GcsServer"]
