"""Who gets a place: clients that may not command keep nobody out."""

from __future__ import annotations

from macromicro.serve.client import ADMITTED, HOLDER, LOCAL, REMOTE, Capacity


class Member:
    def __init__(self, rank: int = REMOTE) -> None:
        self.rank, self.heard = rank, 0.0
        self.dismissed = False

    def dismiss(self) -> None:
        self.dismissed = True


def test_a_higher_rank_takes_the_place_of_the_oldest_of_the_lowest() -> None:
    found = Capacity(3, 8)
    members = [Member(ADMITTED), Member(), Member()]
    assert all(found.claim(member) for member in members)
    assert not found.claim(Member())
    assert found.claim(Member(ADMITTED)) and members[1].dismissed and not members[2].dismissed
    assert found.claim(Member(LOCAL)) and members[2].dismissed
    assert found.claim(Member(ADMITTED))
    assert not found.claim(Member(ADMITTED)) and not members[0].dismissed
    assert found.claim(Member(HOLDER)) and members[0].dismissed


def test_whoever_logs_in_later_is_no_stranger() -> None:
    found = Capacity(1, 8)
    member = Member()
    found.claim(member)
    member.rank = ADMITTED
    assert not found.claim(Member(ADMITTED))
    found.leave(member)
    assert found.claim(Member())


def test_a_page_takes_its_own_place_again() -> None:
    found = Capacity(1, 8)
    old, new = Member(ADMITTED), Member(ADMITTED)
    assert found.claim(old) and found.claim(new, instead=old)
    assert not old.dismissed and not found.claim(Member(ADMITTED))


def test_of_the_silent_ones_the_oldest_goes() -> None:
    found = Capacity(2, 3)
    members = [Member() for _ in range(5)]
    for member in members:
        found.arrive(member)
    assert [member.dismissed for member in members] == [True, True, False, False, False]
    assert found.claim(members[2])
    found.arrive(Member())
    assert not members[3].dismissed


def test_the_one_silent_longest_yields_to_a_newcomer() -> None:
    found = Capacity(3, 8, yielding=True)
    members = [Member(ADMITTED), Member(), Member()]
    for member, heard in zip(members, (1.0, 3.0, 2.0), strict=True):
        member.heard = heard
        assert found.claim(member)
    assert found.crowd == 2
    newcomer = Member()
    newcomer.heard = 4.0
    assert found.claim(newcomer) and members[2].dismissed and not members[1].dismissed
    newcomer.rank = members[1].rank = ADMITTED
    assert not found.claim(Member(ADMITTED)) and not found.claim(Member())
