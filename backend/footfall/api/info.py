"""What this server is: version, whether the scene could start, whether a simulated rover runs."""

from typing import Any

from fastapi import Request

from footfall.api.routing import Routes
from footfall.core.value import SOFTWARE_VERSION

router = Routes(tags=["info"])


@router.get("/info")
def info(request: Request) -> dict[str, Any]:
    """Version and parts of the running server."""
    return {"version": SOFTWARE_VERSION, **request.app.state.parts()}
