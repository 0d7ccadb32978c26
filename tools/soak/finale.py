"""What ends the loop or the server or keeps it from starting; after each of it, a new start."""

from __future__ import annotations

import csv
import math
import random
import time
from functools import partial

import faulty
from soak.campaign import Round
from soak.disturbing import port_in_use
from soak.judge import judge
from soak.victim import Client, Victim, safe_after, until

KILLS = 3


def finale(victim: Victim, seed: int) -> tuple[list[Round], list[str]]:
    """Rounds and complaints. The server runs at the beginning, and has ended at the end."""
    rng, rounds, complaints = random.Random(seed), [], []
    said = port_in_use(victim)
    if "in use" not in said:
        complaints.append(f"port in use: {said}")
    rounds.append(Round("port in use", "", 0, math.nan, said, ""))
    for name in (*["server killed"] * KILLS, "unplugged"):
        client = Client(victim.port)
        _move(client, victim)
        time.sleep(rng.uniform(0.05, 0.3))
        if name == "unplugged":
            faulty.inject(victim.cells, name)
            until(partial(_off, client))
            told = next(csv.reader([client.ask("FAUL?")]))[2]
            safe = safe_after(victim)
            faulty.inject(victim.cells, faulty.NONE)
            until(partial(_on, client))  # it is opened again by itself
        else:
            told, safe = "at the next start: a motion was interrupted, home first", victim.kill()
        client.close()
        rounds.append(Round(name, "MOVE", 0, max(safe, 0.0), told, "lost"))
        complaints += _left(victim, name)
        if name != "unplugged":
            victim.start()
        complaints += _started(victim, name)
    if (status := victim.end()) != 128 + 15:
        complaints.append(f"it ended with status {status}: {victim.said()}")
    return rounds, complaints


def _off(client: Client) -> bool:
    return client.ask("MODE?") == '"off"'


def _on(client: Client) -> bool:
    return not _off(client)


def _move(client: Client, victim: Victim) -> None:
    """A long macro move that is under way."""
    until(lambda: client.ask("SYST:LOCK:REQ?") == "1")
    client.send("ENAB")
    client.send("HOME")
    until(lambda: client.ask("MOVE:NUMB?") == "0", 90.0)
    client.send("MOVE:MACR 2500")
    until(lambda: abs(victim.cells[faulty.MOTOR]) > 2.0)


def _left(victim: Victim, name: str) -> list[str]:
    """What is wrong with what the dead server left."""
    found = []
    if any(victim.cells[[faulty.MOTOR, faulty.CTRL, faulty.FAN]] != 0.0):
        found.append(f"{name}: outputs were left on")
    for path in sorted(victim.recordings.glob("*.h5")):
        verdict = judge(path)
        if verdict.gaps or verdict.illegal or verdict.unsafe or not verdict.rows:
            found.append(f"{name}: recording: {verdict}")
        path.unlink()
    return found


def _started(victim: Victim, name: str) -> list[str]:
    """What is wrong with how it started again."""
    client = Client(victim.port)
    until(lambda: client.ask("SYST:LOCK:REQ?") == "1")
    trust = client.ask("POS:TRUS?")
    client.send("ENAB")
    client.send("MOVE 20 mm")
    error = client.ask("SYST:ERR?")
    moved = any(victim.cells[[faulty.MOTOR, faulty.CTRL]] != 0.0)
    client.send("DIS")
    client.ask("MODE?")
    client.close()
    fine = trust.startswith("0,") and "home" in error and not moved
    return [] if fine else [f"{name}, started again: {trust}; {error}; moved: {moved}"]
