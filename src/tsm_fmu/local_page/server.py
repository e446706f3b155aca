"""The web server of the local page: routes that hand JSON to a `Session`. It listens on this machine only."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from importlib.resources import files
from typing import Any

from markupsafe import Markup
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from ..models.contract import InputError
from ..report.embed import rendered
from .session import Session, models

LARGEST_LOG = 500e6
"""Bytes of one dropped log."""
HOSTS = ["127.0.0.1", "localhost"]
"""Names under which the page answers: a page of another site cannot reach it by a name of its own."""


def web_app(session: Session) -> Starlette:
    """The page and its routes for one session."""

    def answers(work: Callable[[Request], Awaitable[Any]]) -> Callable[[Request], Awaitable[Response]]:
        async def route(request: Request) -> Response:
            origin = request.headers.get("origin")
            if origin is not None and origin != f"http://{request.headers.get('host')}":
                return JSONResponse({"error": f"origin {origin} -- expected this page -- open it anew"}, 403)
            try:
                made = await work(request)
            except InputError as wrong:
                return JSONResponse({"error": str(wrong)}, 400)
            return made if isinstance(made, Response) else JSONResponse(made)

        return route

    async def index(_: Request) -> Response:
        script = Markup(files("tsm_fmu.local_page").joinpath("page.js").read_text(encoding="utf-8"))
        return HTMLResponse(rendered("local_page.html", models=models(), program=script))

    async def add_log(request: Request) -> Any:
        async with request.form(max_files=1, max_part_size=int(LARGEST_LOG)) as form:
            file: Any = form.get("file")
            if file is None or isinstance(file, str):
                raise InputError("no file -- expected a log -- drop one")
            data = await file.read()
        return await asyncio.to_thread(session.add_log, file.filename or "", data)

    async def map_log(request: Request) -> Any:
        mapping = await request.json()
        return await asyncio.to_thread(session.map_log, request.path_params["name"], mapping)

    async def picture(request: Request) -> Any:
        return HTMLResponse(await asyncio.to_thread(session.picture, request.path_params["name"]))

    async def proposal(request: Request) -> Any:
        model = request.query_params.get("model", "")
        return await asyncio.to_thread(session.proposal, request.path_params["name"], model)

    async def start(request: Request) -> Any:
        asked = await request.json()
        job = session.start(asked["verb"], asked["model"], asked["runs"], asked["holdout"], asked["reference"])
        return job.as_json()

    async def jobs(_: Request) -> Any:
        return [job.as_json() for job in session.jobs]

    async def cancel(request: Request) -> Any:
        job = _job(session, request)
        job.cancel()
        return job.as_json()

    async def file(request: Request) -> Any:
        job, name = _job(session, request), request.path_params["file"]
        if name not in job.as_json()["files"]:
            raise InputError(f"file {name!r} -- expected one of the job's files -- choose it on the page")
        kind = "inline" if name.endswith(".html") else "attachment"
        return FileResponse(job.request.folder / name, filename=name, content_disposition_type=kind)

    return Starlette(
        routes=[
            Route("/", answers(index)),
            Route("/logs", answers(add_log), methods=["POST"]),
            Route("/logs/{name}/map", answers(map_log), methods=["POST"]),
            Route("/logs/{name}/picture", answers(picture)),
            Route("/logs/{name}/proposal", answers(proposal)),
            Route("/jobs", answers(start), methods=["POST"]),
            Route("/jobs", answers(jobs)),
            Route("/jobs/{job:int}/cancel", answers(cancel), methods=["POST"]),
            Route("/jobs/{job:int}/{file}", answers(file)),
        ],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=HOSTS)],
    )


def _job(session: Session, request: Request) -> Any:
    number = request.path_params["job"]
    if number >= len(session.jobs):
        raise InputError(f"job {number} -- expected one below {len(session.jobs)} -- load the page anew")
    return session.jobs[number]
