"""Work on the newest value only: of those that arrive while it is at work, all but the last are dropped."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Newest(Generic[Value]):
    """Calls a coroutine with the newest value, one call at a time.

    Parameters
    ----------
    work
        The coroutine function.
    """

    def __init__(self, work: Callable[[Value], Awaitable[None]]) -> None:
        self._work = work
        self._waiting: list[Value] = []
        self._task: asyncio.Task[None] | None = None

    def ask(self, value: Value) -> None:
        """Have the work done with a value, unless a newer one comes before it can begin."""
        self._waiting = [value]
        if self._task is None or self._task.done():
            self._task = asyncio.ensure_future(self._go())

    async def _go(self) -> None:
        while self._waiting:
            await self._work(self._waiting.pop())
