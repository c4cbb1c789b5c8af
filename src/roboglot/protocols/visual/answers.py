"""Answers to one request, in the manual's words (0.2.1.2)."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Protocol

from roboglot.model.tap import Tap
from roboglot.protocols.visual.vocabulary import key_of
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.replies import feedback, responses
from roboglot.wire.visual.requests import Request

DOOR = "visual"


class Outlet(Protocol):
    """Receiver of answers, which passes them to every front end."""

    def answer(self, text: str) -> None:
        """Send one frame."""

    def answer_list(self, kind: str, id: str, items: Sequence[Mapping[str, object]]) -> None:
        """Send a list, in frames of a length that each front end can take."""


class Answers:
    """Formats and sends the answers to ``request``. ``target`` None: the request's first target.

    ``note`` is called once when the request is accepted, before the answer is sent.
    """

    def __init__(
        self,
        request: Request,
        outlet: Outlet,
        note: Callable[[Request], Awaitable[None]] | None = None,
        tap: Tap | None = None,
        began: float | None = None,
    ) -> None:
        self._request = request
        self._tap = tap
        self._began = began  # time at which the tap noted the request
        self._outlet = outlet
        self._note = note

    async def accept(self, target: str | None = None) -> None:
        """Send that the request was done, or is legal and will be done."""
        note, self._note = self._note, None
        if note is not None:
            await note(self._request)
        self._feedback(target, FeedbackState.OK, f"{self._request.operate} {self._request.kind}")

    def refuse(self, state: FeedbackState, describe: str, target: str | None = None) -> None:
        """Send the reason why the request was not done."""
        self._feedback(target, state, describe)

    def list(self, items: Sequence[Mapping[str, object]]) -> None:
        """Send the answer to an inquiry."""
        request = self._request
        if self._tap is not None and self._tap.watched:
            texts = responses(kind=request.kind, id=request.id, items=items)
            self._tap.reply(DOOR, key_of(request), texts[0], "ok", began=self._began)
        self._outlet.answer_list(request.kind, request.id, items)

    def _feedback(self, target: str | None, state: FeedbackState, describe: str) -> None:
        request = self._request
        if target is None:
            target = request.targets[0] if request.targets else ""
        text = feedback(
            kind=request.kind,
            id=request.id,
            target=target,
            operate=request.operate,
            state=state,
            describe=describe,
        )
        if self._tap is not None and self._tap.watched:
            done = state == FeedbackState.OK
            status, why = "ok" if done else f"state {int(state)}", "" if done else describe
            self._tap.reply(DOOR, key_of(request), text, status, why, self._began)
        self._outlet.answer(text)
