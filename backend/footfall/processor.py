"""How libraries use the processor: chosen before any of them is loaded.

OpenBLAS, which numpy, scipy and OpenCV bring along, takes other code on other processors. That adds in another order
and so rounds otherwise, and a search that chooses between two ways as good as each other then takes the other one: a
session that one machine recorded came out different on the next. Here all of x86-64 takes the code for Haswell, the
oldest with AVX2, and sums on one thread: how many cores there are makes no difference either. Processors without AVX2,
or of another family, keep their own.
"""

import os
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

NEEDED = {"avx2", "fma"}
"""What a processor must have for OpenBLAS' code for Haswell."""

LATE = (
    "numpy was loaded before footfall here, so sums are rounded as this kind of processor does it, and a search may "
    "choose otherwise: import footfall first"
)


@cache
def choose_arithmetic() -> bool:
    """Set what libraries look at when they are loaded; what is set already stays. False where it is too late."""
    chosen = {name: value for name, value in choices(_features()).items() if name not in os.environ}
    os.environ.update(chosen)
    return "OPENBLAS_CORETYPE" not in chosen or "numpy" not in sys.modules


def choices(features: set[str]) -> Mapping[str, str]:
    """Environment variables and their values, for a processor with these features as Linux names them."""
    # compiled loops share the machine with other processes: threads that wait must sleep, not spin
    found = {"OMP_WAIT_POLICY": "passive", "OPENBLAS_NUM_THREADS": "1"}
    return {**found, "OPENBLAS_CORETYPE": "Haswell"} if features >= NEEDED else found


def _features() -> set[str]:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
    except OSError:  # not Linux
        return set()
    return next((set(line.partition(":")[2].split()) for line in lines if line.startswith("flags")), set())
