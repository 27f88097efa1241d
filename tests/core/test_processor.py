"""The libraries add in the same order on every processor of a family, whoever loads them."""

import os
import subprocess
import sys

import pytest

from footfall.processor import LATE, NEEDED, choices, choose_arithmetic

OURS = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "OMP_WAIT_POLICY")


def run(program, **variables):
    """What a new process prints, on both ways, that inherits nothing which was chosen here."""
    kept = {name: text for name, text in os.environ.items() if name not in OURS}
    done = subprocess.run([sys.executable, "-c", program], env={**kept, **variables}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


def test_old_and_other_processors_keep_their_own_code():
    assert choices({*NEEDED, "sse2"})["OPENBLAS_CORETYPE"] == "Haswell"
    for features in (set(), {"sse2"}, {"avx2"}, {"asimd", "fma"}):
        assert "OPENBLAS_CORETYPE" not in choices(features)
        assert choices(features)["OPENBLAS_NUM_THREADS"] == "1"


def test_every_library_takes_the_same_code():
    if "OPENBLAS_CORETYPE" not in os.environ:
        pytest.skip("this processor has no AVX2 and keeps its own code")
    _, loaded = run("import footfall, scipy.linalg, cv2", OPENBLAS_VERBOSE="2")
    cores = [line for line in loaded.splitlines() if line.startswith("Core:")]
    assert len(cores) >= 3  # one each of numpy, scipy and OpenCV
    assert set(cores) == {"Core: Haswell"}


def test_what_is_set_already_stays():
    program = "import footfall, os; print(os.environ['OPENBLAS_CORETYPE'])"
    assert run(program, OPENBLAS_CORETYPE="Nehalem")[0] == "Nehalem"


def test_numpy_that_was_loaded_first_is_noticed():
    told = "from footfall.processor import choose_arithmetic; print(choose_arithmetic())"
    assert run(told)[0] == "True"
    if "OPENBLAS_CORETYPE" in os.environ:
        assert run(f"import numpy; {told}")[0] == "False"
        assert run(f"import numpy; {told}", OPENBLAS_CORETYPE="Haswell")[0] == "True"


def test_here_it_was_chosen_in_time():
    assert choose_arithmetic(), LATE
