"""``make soak``: a session in which all goes wrong, at random points; exit code 1 on any loss.

Server, worker and rover are killed (SIGKILL), the link is cut, delayed, repeated, reordered, half of it lost, workers
hang, and all the while one client never reads.
"""

import argparse
import signal
import statistics
import subprocess
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.soak.cycles import KINDS, MOMENTS, Cycle, Soak


def main() -> int:
    """Run the cycles and print what became of them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cycles", type=int, default=200)
    parser.add_argument("--seed", type=int, default=20081)
    parser.add_argument("--light", action="store_true", help="no whole steps: waits on the rover instead")
    parser.add_argument("--hurry", type=float, default=5.0, help="how much faster than the world the rover's time runs")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(2))  # as after Ctrl-C, nothing is left running
    cycles: list[Cycle] = []
    with TemporaryDirectory(prefix="footfall-soak-") as folder:
        with Soak(Path(folder), options.seed, options.hurry) as soak:
            for number in range(options.cycles):
                moment = MOMENTS[number % len(MOMENTS)]
                one = soak.cycle(KINDS[number % len(KINDS)], moment, steps=not options.light)
                cycles.append(one)
                print(f"{number + 1:4d} {one.kind:<7}{one.recovery:6.1f} s  {one.during[:90]}", flush=True)
                for text in (*one.verdict.lost, *one.verdict.doubled, *one.verdict.damage, *one.problems):
                    print(f"     NOT AS IT SHOULD BE: {text}", flush=True)
            waiting = [one["waiting"] for one in soak.script.listeners()]
            through = soak.link.done
        last = soak.compare()
        command = [str(Path(sys.executable).with_name("footfall")), "sessions", "verify", "--data", str(soak.data)]
        verified = subprocess.run(command, capture_output=True, text=True, check=False)
    for kind in KINDS:
        times = sorted(one.recovery for one in cycles if one.kind == kind)
        if times:
            p95 = times[min(len(times) - 1, int(0.95 * len(times)))]
            moving = sum(one.under_way == "LEG_MOVE" for one in cycles if one.kind == kind)
            stopped = sum(one.stopped for one in cycles if one.kind == kind)
            print(
                f"{kind:<8}{len(times):4d} times, {moving} while a leg moved, {stopped} while stopped; "
                f"back after {statistics.median(times):.1f} s, p95 {p95:.1f} s"
            )
    told = Counter(one.how for one in cycles if one.kind == "link")
    print("the link: " + ", ".join(f"{how} {count}" for how, count in sorted(told.items())))
    print("messages through it: " + ", ".join(f"{count} {what}" for what, count in sorted(through.items())))
    print(f"messages that wait for listeners, one of which never reads: {', '.join(map(str, waiting))}")
    notes, runs, products = len(soak.ledger.notes), len(soak.ledger.runs), len(soak.ledger.products)
    print(f"acknowledged: {len(soak.ledger.heard)} events heard, {notes} notes, {runs} runs, {products} products")
    print(f"in the log: {last.events} events; commands: {last.sent} sent, {last.executed} carried out")
    lost = {text for one in (*(c.verdict for c in cycles), last) for text in one.lost}
    doubled = {text for one in (*(c.verdict for c in cycles), last) for text in one.doubled}
    stuck = sum(len(one.problems) for one in cycles)
    print(f"lost: {len(lost)}; doubled: {len(doubled)}; not gone on: {stuck}; rover set up anew: {soak.set_up_again}")
    print(f"footfall sessions verify: exit code {verified.returncode}\n{verified.stdout.rstrip()}")
    return 0 if all(one.ok for one in cycles) and last.ok and verified.returncode == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
