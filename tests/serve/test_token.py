"""The token, and the count of wrong ones by address."""

from __future__ import annotations

import pytest

from macromicro.serve import hosts as guesses
from macromicro.serve.hosts import WRONG, Guesses, Token, network


def test_a_few_wrong_ones_shut_an_address_out_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(guesses.time, "monotonic", lambda: now[0])
    found = Guesses(3, 60.0)
    for _ in range(3):
        assert found.wait("192.0.2.1") == 0.0
        found.wrong("192.0.2.1")
        now[0] += 1.0
    assert found.wait("192.0.2.1") == pytest.approx(57.0)
    assert found.wait("192.0.2.2") == 0.0
    now[0] += 57.0
    assert found.wait("192.0.2.1") == 0.0
    found.wrong("192.0.2.1")  # one is forgotten, the others are not yet
    assert found.wait("192.0.2.1") == pytest.approx(1.0)


def test_memory_is_bounded() -> None:
    found = Guesses(1, 60.0)
    for k in range(3 * guesses.MOST):
        found.wrong(f"10.{k >> 16}.{k >> 8 & 255}.{k & 255}")
    assert len(found._wrong) == guesses.MOST


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("192.0.2.1", "192.0.2.2", False),
        ("2001:db8::1", "2001:db8::ffff:1", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("fe80::1%eth0", "fe80::2", True),
        ("::ffff:192.0.2.1", "192.0.2.1", True),
        ("?", "?", True),
    ],
)
def test_an_address_that_is_changed_at_will_counts_once(one: str, other: str, same: bool) -> None:
    assert (network(one) == network(other)) == same


def test_tokens() -> None:
    token = Token("open sesame", Guesses(100, 60.0))
    assert not token.problem("open sesame", "192.0.2.1") and not token.open
    for wrong in ("open sesam", "", None, 7, "open sesame ", "öpen sesame", "\ud800"):
        assert token.problem(wrong, "192.0.2.1")
    assert not Token(None).problem(None, "192.0.2.1") and Token(None).open


def test_all_protocols_count_together() -> None:
    token = Token("open sesame", Guesses(3, 60.0))
    said = [token.problem(f"guess {k}", "192.0.2.1") for k in range(5)]
    assert said[:3] == [WRONG] * 3 and all("wait 60 s" in words for words in said[3:])
    assert "wait" in token.problem("open sesame", "192.0.2.1")
    assert not token.problem("open sesame", "192.0.2.1", known=True)
    assert not token.problem("open sesame", "192.0.2.2")
