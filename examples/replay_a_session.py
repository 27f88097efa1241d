"""Recompute every product of a recorded session from its parents, and compare."""

import sys

import footfall
from footfall.resources import sample_sessions_folder


def main() -> None:
    bundle = sys.argv[1] if len(sys.argv) > 1 else sample_sessions_folder() / "refused-step"
    report = footfall.replay(bundle)
    print(f"{report.name}: {'the same' if report.ok else 'NOT the same'}")
    for line in report.lines():
        print(f"  {line}")
    if not report.ok:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
