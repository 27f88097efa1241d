"""From a footfall to commands over REST: `python over_rest.py http://127.0.0.1:8080`, with FootFall running."""

import sys
import time

import httpx


def main() -> None:
    address = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
    with httpx.Client(base_url=f"{address}/api/v1", timeout=60) as ground:
        ground.post("/sessions/current/state", json={}).raise_for_status()
        order = {"leg": 2, "target": [-0.45, 1.8], "settings": {"seed": 1}}
        job = ground.post("/sessions/current/plans", json=order).raise_for_status().json()
        while (told := ground.get(f"/jobs/{job['id']}").json())["state"] in ("queued", "running"):
            time.sleep(0.1)
        print(f"plan: {told['state']}")
        plan = ground.get("/sessions/current/plans/current").json()
        print(f"{plan['status']}: {plan['reason']}")
        sequence = ground.post("/sessions/current/sequences", json={}).raise_for_status().json()
        file = ground.get(f"/sequences/{sequence['digest']}/export", params={"format": "seqjson"}).raise_for_status()
        print(f"{len(sequence['commands'])} commands, {len(file.content)} bytes of SeqJSON")


if __name__ == "__main__":
    main()
