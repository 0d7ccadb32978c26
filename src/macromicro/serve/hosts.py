"""Addresses to listen at."""

from __future__ import annotations

import ipaddress


def is_loopback(host: str) -> bool:
    """Can only this computer reach the address?"""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
