"""How a terrain build sees the images: disparities in colours, and the robot's pixels."""

from typing import Annotated, TypedDict

from fastapi import Depends, Request, Response

from footfall.api.access import OneSession
from footfall.api.routes.images import PairName, SnapshotName, pair_of
from footfall.api.routing import Routes, files
from footfall.core.errors import NotFound
from footfall.io.image_files import encode_png
from footfall.session.answers.jobs import Share
from footfall.session.answers.notes import DigestText
from footfall.session.products.image_views import ImageViews

router = Routes(tags=["images"])

_RAMP_COLOURS = 16


class ColourEnd(TypedDict):
    """One end of the colours of disparities: [px], and the depth that it stands for [m]."""

    disparity: float
    depth: float


class DisparityLegend(TypedDict):
    """Colours of the disparity picture, evenly from far to near; known: share of the pixels that were matched."""

    known: Share
    far: ColourEnd
    near: ColourEnd
    ramp: list[list[int]]
    unknown: list[int]


class MaskLegend(TypedDict):
    """Colours of the mask picture; shares of the pixels of the left image. legs: how their places were found."""

    robot_share: Share
    rim_share: Share
    robot: list[int]
    rim: list[int]
    legs: str


class ViewsAnswer(TypedDict):
    """What a terrain build from all pairs of the snapshot sees in one of them.

    disparity: null where the pair can't be used; the reason says why. used: share of the pixels that are matched and do
    not show the robot.
    """

    snapshot: DigestText
    pair: str
    used: Share
    reason: str
    disparity: DisparityLegend | None
    mask: MaskLegend


def _views(request: Request) -> ImageViews:
    return request.app.state.image_views


Views = Annotated[ImageViews, Depends(_views)]


@router.get("/sessions/{session}/images/{pair}/views")
def describe_views(live: OneSession, views: Views, pair: PairName, of: SnapshotName = "current") -> ViewsAnswer:
    """Legends of the pictures of a pair. Asked first for a snapshot, all of its pairs are matched, by a worker."""
    import numpy as np

    from footfall.terrain import pair_views

    snapshot, _ = pair_of(live, of, pair)
    made = views.of(live, snapshot)
    view = made.of(pair)
    disparity: DisparityLegend | None = None
    if view.disparity is not None:
        far, near = ({"disparity": d, "depth": z} for d, z in zip(view.ends, view.ranges, strict=True))
        disparity = {
            "known": float(np.isfinite(view.disparity).mean()),
            "far": ColourEnd(**far),
            "near": ColourEnd(**near),
            "ramp": pair_views.ramp(_RAMP_COLOURS).tolist(),
            "unknown": list(pair_views.UNMATCHED_RGB),
        }
    return {
        "snapshot": snapshot.digest,
        "pair": pair,
        "used": view.used,
        "reason": view.reason,
        "disparity": disparity,
        "mask": {
            "robot_share": float((view.mask == pair_views.ROBOT).mean()),
            "rim_share": float((view.mask == pair_views.RIM).mean()),
            "robot": list(pair_views.ROBOT_RGB),
            "rim": list(pair_views.RIM_RGB),
            "legs": made.legs,
        },
    }


@router.get("/sessions/{session}/images/{pair}/disparity.png", response_class=Response, responses=files("image/png"))
def disparity_image(live: OneSession, views: Views, pair: PairName, of: SnapshotName = "current") -> Response:
    """Disparities of the left image in colours; `views` has the legend. 404 where the pair can't be used."""
    from footfall.terrain.pair_views import disparity_picture

    snapshot, _ = pair_of(live, of, pair)
    view = views.of(live, snapshot).of(pair)
    if view.disparity is None:
        raise NotFound(f"there are no disparities of {pair}: {view.reason}", pair=pair)
    return Response(encode_png(disparity_picture(view)), media_type="image/png")


@router.get("/sessions/{session}/images/{pair}/mask.png", response_class=Response, responses=files("image/png"))
def mask_image(live: OneSession, views: Views, pair: PairName, of: SnapshotName = "current") -> Response:
    """The left image with the pixels tinted that are left out of a terrain because they show the robot, or may."""
    from footfall.terrain.pair_views import mask_picture

    snapshot, found = pair_of(live, of, pair)
    return Response(encode_png(mask_picture(views.of(live, snapshot).of(pair), found)), media_type="image/png")
