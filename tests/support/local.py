"""A client of an app in this process: no socket, one request at a time."""

import asyncio
from typing import Any

import httpx
from fastapi import FastAPI

from footfall.api.access import BASE


class Local:
    """Asks ``app``; paths are those under ``/api/v1/``, or whole ones."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app

    def request(self, method: str, path: str, **named: Any) -> httpx.Response:
        async def ask() -> httpx.Response:
            transport = httpx.ASGITransport(self._app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
                return await client.request(method, path if path.startswith("/") else f"{BASE}/{path}", **named)

        return asyncio.run(ask())

    def get(self, path: str, **named: Any) -> httpx.Response:
        return self.request("GET", path, **named)

    def post(self, path: str, **named: Any) -> httpx.Response:
        return self.request("POST", path, **named)
