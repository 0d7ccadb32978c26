"""The one way in for every protocol that this package speaks over TCP.

A protocol on `door.connection.Connection`, served by `door.server`, has all of it: the check of the
first line, limits of rate and size, keep-alive, and the rule by which a client that is gone, dead
or deaf is lost.
"""
