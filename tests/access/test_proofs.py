"""Limits on guessing passwords, also those that are in use."""

from __future__ import annotations

import base64

import pytest

from roboglot.access import proofs
from roboglot.access.identities import Identities
from roboglot.access.proofs import TRIES_OF_ONE_NAME, Proofs
from roboglot.access.secrets import token_hash
from roboglot.access.store import Identity, IdentityKind
from roboglot.model.admission import LockedOut, Proof, ProofKind, Unknown

LOGINS = 3
HOME, ELSEWHERE = "10.0.0.5", "10.0.0.66"


def basic(password: str) -> Proof:
    return Proof(ProofKind.HTTP, "Basic " + base64.b64encode(f"anna:{password}".encode()).decode())


RIGHT = basic("correct horse")
TOKEN = Proof(ProofKind.HTTP, "Bearer 12345")


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch) -> Proofs:
    """A person's proofs within one minute, in which passwords are compared without a slow hash."""
    monkeypatch.setattr(proofs, "password_fits", lambda password, kept: password == kept)
    people = [
        Identity("anna", IdentityKind.PERSON, "correct horse", None, ()),
        Identity("cell", IdentityKind.MACHINE, "", token_hash("12345"), ()),
    ]
    known = Proofs(Identities(people), LOGINS)
    for limiter in (known._tries, known._tries_of_name, known._tries_of_device):
        monkeypatch.setattr(limiter, "_now", lambda: 0.0)
    return known


async def admitted(known: Proofs, proof: Proof, host: str) -> bool:
    if known.known(proof, f"{host}:4242"):
        return True
    try:
        return bool(await known.find(proof, host))
    except Unknown:
        return False


async def guess(known: Proofs, count: int, host: str) -> None:
    for number in range(count):
        with pytest.raises(Unknown):
            await known.find(basic(f"guess {number}"), host)


@pytest.mark.parametrize("host", [HOME, ELSEWHERE])
async def test_lock_outs_hold_for_a_password_in_use(known: Proofs, host: str) -> None:
    assert await admitted(known, RIGHT, HOME)
    await guess(known, LOGINS, host)
    assert not await admitted(known, RIGHT, host)  # else guessing goes on, and the right guess is answered
    assert await admitted(known, RIGHT, HOME) is (host != HOME)
    assert await admitted(known, TOKEN, host)


async def test_guesses_from_many_addresses_find_nothing(known: Proofs) -> None:
    assert await admitted(known, RIGHT, HOME)
    for number in range(TRIES_OF_ONE_NAME):
        await guess(known, LOGINS, f"10.0.1.{number}")
    with pytest.raises(LockedOut, match="for anna"):
        await known.find(RIGHT, ELSEWHERE)
    assert not await admitted(known, RIGHT, ELSEWHERE)
    assert await admitted(known, RIGHT, HOME)  # others cannot lock its owner out


@pytest.mark.parametrize("used", [True, False])
async def test_guesses_do_not_end_sessions(known: Proofs, used: bool) -> None:
    session = Proof(ProofKind.SESSION, RIGHT.value)
    if used:
        assert await admitted(known, RIGHT, HOME)
    await guess(known, LOGINS, HOME)
    assert await admitted(known, session, HOME)
    assert await admitted(known, session, ELSEWHERE)
    known.renew(Identities([]), {"anna"})
    assert not await admitted(known, session, HOME)


async def test_known_browser_has_tries_of_its_own(known: Proofs) -> None:
    device = known.device("anna", "")
    for number in range(TRIES_OF_ONE_NAME):
        await guess(known, LOGINS, f"10.0.1.{number}")
    await guess(known, LOGINS, HOME)  # from the same address: pupils behind one router
    assert not await admitted(known, RIGHT, HOME)
    assert await admitted(known, RIGHT._replace(device=device), HOME)
    assert known.device("anna", device) == device  # logging in again makes no further tries

    for host in (HOME, *(f"10.0.2.{number}" for number in range(LOGINS - 1))):
        assert not await admitted(known, basic("a guess")._replace(device=device), host)
    with pytest.raises(LockedOut, match="in this browser"):
        await known.find(RIGHT._replace(device=device), ELSEWHERE)


@pytest.mark.parametrize("forged", ["ben's", "older", "", ".", "1.2", "\ud800.\ud800"])
async def test_only_an_earlier_log_in_makes_a_mark(known: Proofs, forged: str) -> None:
    ben = Identity("ben", IdentityKind.PERSON, "password of ben", None, ())
    older = Identity("anna", IdentityKind.PERSON, "older", None, ())
    marks = {"ben's": ("ben", ben), "older": ("anna", older)}
    if forged in marks:
        name, owner = marks[forged]
        forged = Proofs(Identities([owner]), LOGINS).device(name, "")
    for number in range(TRIES_OF_ONE_NAME):
        await guess(known, LOGINS, f"10.0.1.{number}")
    with pytest.raises(LockedOut, match="for anna"):
        await known.find(RIGHT._replace(device=forged), ELSEWHERE)
    assert known.device("cell", "") == known.device("unknown", "") == ""
