"""`footfall compile` leaves no kernel for an operator to wait for."""

import subprocess
import sys

# In a process of its own: what other tests called does not count.
PROBE = """
import importlib, pkgutil
from pathlib import Path
import footfall
from numba.core.registry import CPUDispatcher
from footfall.compiling import SCENE, WORK, compile_kernels

told = []
compile_kernels(lambda fraction, text: told.append((fraction, text)))
assert told[0] == (0.0, SCENE)
assert told[-1][0] == 1.0
assert sorted(text for _, text in told[1:]) == sorted(f"{work}: compiled" for work in WORK), told
for found in pkgutil.walk_packages(footfall.__path__, "footfall."):
    if found.name.endswith(("__main__", "generate")):
        continue
    for name, item in vars(importlib.import_module(found.name)).items():
        inlined = isinstance(item, CPUDispatcher) and item.targetoptions.get("inline") == "always"
        if isinstance(item, CPUDispatcher) and item.__module__ == found.name and not inlined:
            kept = Path(item.stats.cache_path).glob(f"*.{item.__name__}-*.nbi")
            if not any(one.name.startswith(found.name.rpartition(".")[2]) for one in kept):
                print(f"{found.name}.{name}")
"""


def test_every_kernel_is_compiled() -> None:
    done = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []
