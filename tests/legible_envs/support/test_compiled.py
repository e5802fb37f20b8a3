"""How kernels are compiled: what they may take, and where compiled code is kept."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.caching import IndexDataCacheFile

from legible_envs.support.compiled import FilesByType, kernel

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


@pytest.mark.parametrize("kind", [IndexDataCacheFile, FilesByType])
def test_processes_that_compile_at_once_do_not_swap_their_code(kind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """What happens in numba's own files, which number code in the order it comes, shows why ours have other names."""
    one, two = (kind(str(tmp_path), "kernel", "stamp") for _ in range(2))
    for files in (one, two):  # both read the index before the other writes
        monkeypatch.setattr(files, "_load_index", dict)
    late = one._save_data
    kept: list[tuple[str, Any]] = []
    monkeypatch.setattr(one, "_save_data", lambda name, data: kept.append((name, data)))
    one.save(("int8",), "code for int8")
    two.save(("int16",), "code for int16")
    for name, data in kept:  # the first was interrupted between its two files
        late(name, data)
    found = kind(str(tmp_path), "kernel", "stamp").load(("int16",))
    assert found == ("code for int16" if kind is FilesByType else "code for int8")


def test_kernels_use_these_files():
    compiled = kernel(lambda values: values)
    if hasattr(compiled, "_cache"):
        assert type(compiled._cache._cache_file) is FilesByType


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
