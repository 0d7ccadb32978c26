"""GCS 2.0 server."""

from macromicro.serve.gcs.server import GcsServer

__all__ = ["GcsServer"]
