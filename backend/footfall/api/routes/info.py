"""What this server is: version, limits, its parts; and what executions and exports can be asked for with."""

from typing import Annotated, Any, NotRequired, TypedDict, cast

from fastapi import Request
from pydantic import Field

from footfall.api.access import AllSessions
from footfall.api.bodies.answers import RoverLinkInfo
from footfall.api.door.limits import Limits, all_limits
from footfall.api.routing import Routes
from footfall.core.value import SOFTWARE_VERSION
from footfall.io.exports import MEDIA, SUFFIXES, TITLES
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings

router = Routes(tags=["info"])


class SceneInfo(TypedDict):
    """Whether the scene is drawn, and where; or why not."""

    available: bool
    reason: str
    url: str


class SimulatedRoverInfo(TypedDict):
    """The simulated rover's process, and what went wrong with it last."""

    running: bool
    pid: int | None
    fault: str


class InfoAnswer(TypedDict):
    """The running server and its parts."""

    version: str
    scene: NotRequired[SceneInfo]
    simulated_rover: NotRequired[SimulatedRoverInfo | None]
    rover_link: RoverLinkInfo
    limits: Annotated[dict[str, Any], Field(description="name → most of it; docs/api.md says of what")]


class ExportFormat(TypedDict):
    """A kind of file that a sequence is exported as."""

    format: str
    title: str
    media_type: str
    ending: str


class ExecutionMode(TypedDict):
    """A way to command a step to a rover that sags."""

    mode: str
    title: str
    text: str


class ChoicesAnswer(TypedDict):
    """What executions and exports can be asked for with."""

    export_formats: list[ExportFormat]
    execution_modes: list[ExecutionMode]
    execution_settings: Annotated[ExecutionSettings, Field(description="the defaults")]


@router.get("/info")
def info(request: Request, sessions: AllSessions) -> InfoAnswer:
    """Version, limits and parts of the running server."""
    limits: Limits = request.app.state.limits
    listed = all_limits(limits, sessions.jobs.queue_limit)
    return cast(InfoAnswer, {**request.app.state.parts(), "version": SOFTWARE_VERSION, "limits": listed})


@router.get("/choices")
def choices() -> ChoicesAnswer:
    """Formats of exports, and modes of executions with the settings' defaults."""
    return {
        "export_formats": [
            {"format": name, "title": TITLES[name], "media_type": MEDIA[name], "ending": SUFFIXES[name]}
            for name in TITLES
        ],
        "execution_modes": [{"mode": mode, "title": title, "text": text} for mode, (title, text) in MODES.items()],
        "execution_settings": ExecutionSettings(),
    }
