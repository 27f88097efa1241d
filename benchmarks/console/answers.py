"""What the server answers to a click: the footfall's verdict, another layer on the ground."""

import time
from collections.abc import Iterator

import httpx

from benchmarks.console.apart import Apart, served_apart
from benchmarks.console.scene_line import LAYERS, SESSION, switching
from benchmarks.timing import Figure


def figures(quick: bool) -> Iterator[Figure]:
    with served_apart(rover=False) as served, served.client() as client:
        mapped(client)
        yield Figure(
            "console.footfall_answer", tuple(answer(client, i) for i in range(20 if quick else 200)), "s", 0.06
        )
        yield Figure("console.layer_switch", tuple(switches(served, client, 3 if quick else 10)), "bytes", 2048)


def mapped(client: httpx.Client) -> None:
    """Maps of leg 2, and the layers shown once."""
    job = client.post(f"{SESSION}/maps", json={"leg": 2})
    job.raise_for_status()
    while (state := client.get(f"/jobs/{job.json()['id']}").json()["state"]) != "done":
        if state not in ("queued", "running"):
            raise RuntimeError(f"the maps are {state}")
        time.sleep(0.1)


def answer(client: httpx.Client, i: int) -> float:
    """Seconds from a click on the ground to what is known of the footfall there."""
    at = {"leg": 2, "x": 1.0 + 0.02 * (i % 20), "y": 2.0 + 0.02 * (i % 7)}
    begin = time.perf_counter()
    client.post(f"{SESSION}/footfalls", json=at).raise_for_status()
    return time.perf_counter() - begin


def switches(served: Apart, client: httpx.Client, count: int) -> Iterator[float]:
    """Bytes to one browser for showing a layer that it has had before; no rover moves meanwhile."""
    with switching(served, client) as scene:
        for i in range(count):
            yield float(scene.switched(LAYERS[(i + 1) % 2])[0])
