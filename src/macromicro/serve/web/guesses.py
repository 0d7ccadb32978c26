"""Wrong tokens of each address, over time."""

from __future__ import annotations

import ipaddress
import time
from collections import OrderedDict, deque

MOST = 1024  # addresses that are remembered; the one that was wrong longest ago goes first


class Guesses:
    """`tries` wrong tokens of an address within `forget` [s]; then none is looked at."""

    def __init__(self, tries: int, forget: float) -> None:
        self._tries, self._forget = tries, forget
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str) -> float:
        """Time [s] until a token of this address is looked at; 0 for now."""
        times = self._wrong.get(network(address))
        if times is None or len(times) < self._tries:
            return 0.0
        return max(times[0] + self._forget - time.monotonic(), 0.0)

    def wrong(self, address: str) -> None:
        """This address gave a wrong token."""
        key = network(address)
        times = self._wrong.setdefault(key, deque(maxlen=self._tries))
        times.append(time.monotonic())
        self._wrong.move_to_end(key)
        while len(self._wrong) > MOST:
            self._wrong.popitem(last=False)


def network(address: str) -> str:
    """What one guesser can change at will does not count: IPv6 by its first 64 bits."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv4Address):
        return str(found)
    return str(found.ipv4_mapped or ipaddress.ip_network((found, 64), strict=False))
