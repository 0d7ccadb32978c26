"""Who gets a place: clients that may not command keep nobody out."""

from __future__ import annotations

from macromicro.serve.seats import ADMITTED, HOLDER, NEIGHBOUR, STRANGER, Places


class Guest:
    def __init__(self, rank: int = STRANGER) -> None:
        self.rank, self.heard = rank, 0.0
        self.dismissed = False

    def dismiss(self) -> None:
        self.dismissed = True


def test_a_higher_rank_takes_the_place_of_the_oldest_of_the_lowest() -> None:
    found = Places(3, 8)
    guests = [Guest(ADMITTED), Guest(), Guest()]
    assert all(found.claim(guest) for guest in guests)
    assert not found.claim(Guest())
    assert found.claim(Guest(ADMITTED)) and guests[1].dismissed and not guests[2].dismissed
    assert found.claim(Guest(NEIGHBOUR)) and guests[2].dismissed
    assert found.claim(Guest(ADMITTED))
    assert not found.claim(Guest(ADMITTED)) and not guests[0].dismissed
    assert found.claim(Guest(HOLDER)) and guests[0].dismissed


def test_whoever_logs_in_later_is_no_stranger() -> None:
    found = Places(1, 8)
    guest = Guest()
    found.claim(guest)
    guest.rank = ADMITTED
    assert not found.claim(Guest(ADMITTED))
    found.leave(guest)
    assert found.claim(Guest())


def test_a_page_takes_its_own_place_again() -> None:
    found = Places(1, 8)
    old, new = Guest(ADMITTED), Guest(ADMITTED)
    assert found.claim(old) and found.claim(new, instead=old)
    assert not old.dismissed and not found.claim(Guest(ADMITTED))


def test_of_the_silent_ones_the_oldest_goes() -> None:
    found = Places(2, 3)
    guests = [Guest() for _ in range(5)]
    for guest in guests:
        found.arrive(guest)
    assert [guest.dismissed for guest in guests] == [True, True, False, False, False]
    assert found.claim(guests[2])
    found.arrive(Guest())
    assert not guests[3].dismissed


def test_the_one_silent_longest_yields_to_a_newcomer() -> None:
    found = Places(3, 8, yielding=True)
    guests = [Guest(ADMITTED), Guest(), Guest()]
    for guest, heard in zip(guests, (1.0, 3.0, 2.0), strict=True):
        guest.heard = heard
        assert found.claim(guest)
    assert found.crowd == 2
    newcomer = Guest()
    newcomer.heard = 4.0
    assert found.claim(newcomer) and guests[2].dismissed and not guests[1].dismissed
    newcomer.rank = guests[1].rank = ADMITTED
    assert not found.claim(Guest(ADMITTED)) and not found.claim(Guest())
