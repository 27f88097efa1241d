"""Products that are ordered with a body, made by a job and read as they are: two routes for each kind in the table."""

from typing import Any

from fastapi import Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.bodies.answers import JobAnswer
from footfall.api.kinds import SERVED, Asked
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes
from footfall.session.products.kinds import Kind


def routes() -> Routes:
    """The routes of every kind that needs none of its own."""
    router = Routes()
    for kind, served in SERVED.items():
        if isinstance(served, Asked):
            _add(router, kind, served)
    return router


def _add(router: Routes, kind: Kind, served: Asked) -> None:
    def order_one(live: OneSession, order: Any, response: Response) -> JobAnswer:
        return accepted(served.ask(live, order), response)

    def read_one(live: OneSession, digest: Digest) -> Any:
        """One answer; ``current`` names the session's latest."""
        return product(live, digest, served.answer, live.state.newest(kind))

    order_one.__doc__ = served.text
    order_one.__annotations__["order"] = served.order
    read_one.__annotations__["return"] = served.answer
    named: dict[str, Any] = {"tags": [served.tag]}
    ordered = f"{served.verb}_{kind.name}"
    router.add_api_route(served.path, order_one, methods=["POST"], status_code=202, name=ordered, **named)
    router.add_api_route(f"{served.path}/{{digest}}", read_one, methods=["GET"], name=f"read_{kind.name}", **named)


router = routes()
