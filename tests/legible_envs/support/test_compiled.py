"""How kernels are compiled: what they may take, and where compiled code is kept."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from legible_envs.support.compiled import kernel

OUTSIDE = """
import sys
import numpy as np
from legible_envs.support.compiled import cache_folder, kernel

@kernel
def last(values):
    return values[len(values)]

try:
    last(np.zeros(3))
    print("read")
except IndexError:
    print("IndexError")
print(cache_folder())
"""


def test_a_kernel_takes_no_random_generator():
    def draw(values: np.ndarray, rng: np.random.Generator) -> float:
        return rng.random()

    with pytest.raises(TypeError, match=r"kernel draw takes a random generator, `rng`: Ctrl-C.*take `bits: Bits`"):
        kernel(draw)


@pytest.mark.slow
def test_code_that_checks_its_indices_is_kept_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Numba does not tell the two apart: what ran first would run ever after."""
    script = tmp_path / "outside.py"
    script.write_text(OUTSIDE)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "chosen"))
    found = []
    for checked in "010":
        monkeypatch.setenv("NUMBA_BOUNDSCHECK", checked)
        done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
        found.append(done.stdout.split())
    (unchecked, folder), (error, inside), again = found
    assert (unchecked, error, inside) == ("read", "IndexError", str(Path(folder) / "boundscheck"))
    assert again == found[0]
