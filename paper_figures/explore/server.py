"""The server of the page: on this machine alone, for those alone who have the token of its address."""

from __future__ import annotations

import asyncio
import hmac
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from socket import create_server, socket
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.settings import settings
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.routing import Router
from tornado.web import ErrorHandler

from design.design_file import Design
from identification.base.errors import InputError
from paper_figures.explore.compute import Explorer
from paper_figures.explore.page import Page
from paper_figures.explore.ranges import ranges
from paper_figures.explore.state import State, from_words

HOST = "127.0.0.1"
TOKEN_BYTES = 24
VALID_S = 10**8  # a page that was opened may be reconnected as long as the server runs


class Guard(Router):
    """Lets a request through to an application where it names this server and knows the token; else it answers 403.

    Parameters
    ----------
    application
        What is guarded, its websocket too.
    token
        The first part of every path.
    port
        A request has to name this host and port, and, where it names its origin, this one: so no other page that the
        browser shows, and no name that somebody lets point to this machine, gets in.
    """

    def __init__(self, application: BokehTornado, token: str, port: int) -> None:
        self._application, self._token, self._place = application, token.encode(), f"{HOST}:{port}"

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """The application's own handler, or one of the error 403."""
        if self._admits(request):
            return self._application.find_handler(request, **kwargs)
        return self._application.get_handler_delegate(request, ErrorHandler, {"status_code": 403})

    def _admits(self, request: HTTPServerRequest) -> bool:
        token = request.path.lstrip("/").partition("/")[0].encode(errors="replace")
        return (
            hmac.compare_digest(token, self._token)
            and request.headers.get_list("Host") == [self._place]
            and all(origin == f"http://{self._place}" for origin in request.headers.get_list("Origin"))
        )


def bound(port: int) -> socket:
    """A socket of this machine alone, at a free port where ``port`` is 0.

    Raises
    ------
    InputError
        The port is taken, or may not be had.
    """
    try:
        place = create_server((HOST, port))
    except OSError as error:
        why = os.strerror(error.errno or 0)
        raise InputError(f"--port is {port}, which cannot be used ({why}); expected a free one") from None
    place.setblocking(False)
    return place


def serve(design: Design, start: State, read: Path, output: Path, place: socket, tell: Callable[[str], object]) -> None:
    """Serve the page until the process ends.

    Parameters
    ----------
    design, start
        The design of the file, and the state that a page begins with.
    read, output
        The file, and the one to save to.
    place
        See :func:`bound`.
    tell
        Called with the address once the page is ready.
    """
    explorer, sliders = Explorer(design, start), ranges(design, start)
    explorer.linear(start.choices, start.true)  # compiles the engine, the first time for some 20 s

    def fill(document: Document) -> None:
        context = document.session_context
        query = context.request.arguments if context is not None and context.request is not None else {}
        words = {name: [each.decode(errors="replace") for each in given] for name, given in query.items()}
        state, refused = start, ""
        try:
            state = from_words(words, start)
        except InputError as error:
            refused = f"{error}."
        Page(document, explorer, state, [each.including(state) for each in sliders], read, output, refused)

    token = secrets.token_urlsafe(TOKEN_BYTES)
    asyncio.run(_served(Application(FunctionHandler(fill)), token, place, tell))


async def _served(application: Application, token: str, place: socket, tell: Callable[[str], object]) -> None:
    port = place.getsockname()[1]
    settings.resources = "server"  # whatever the environment says: no network is needed
    guarded = BokehTornado(
        {"/": application},
        prefix=token,
        extra_websocket_origins=[f"{HOST}:{port}"],
        session_token_expiration=VALID_S,
        log_function=lambda _handler: None,
    )
    http = HTTPServer(Guard(guarded, token, port))
    http.add_sockets([place])
    BaseServer(IOLoop.current(), guarded, http).start()
    tell(f"http://{HOST}:{port}/{token}/")
    await asyncio.Event().wait()
