"""Results are recorded again: `python -m tests.support.recording [NAME...]`.

Each is computed for this processor and five others, and what all agree about is written to `tests/recorded/NAME.json`,
of the studies to `studies/tests/recorded`. Before that, read what has changed: it has to be what you meant to change.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.support import recorded, studied, subjects

NO_AVX2 = "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"
NO_FMA = "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"
PROCESSORS = {
    "compiled for any": ("generic", "", "", "", "", "avx2", ""),
    "any": (
        "generic",
        "",
        NO_AVX2,
        "Nehalem",
        "--xla_cpu_max_isa=SSE4_2",
        "default",
        NO_FMA,
    ),
    "SSE": (
        "nehalem",
        "+sse4.2",
        NO_AVX2,
        "Prescott",
        "--xla_cpu_max_isa=SSE4_2",
        "default",
        NO_FMA,
    ),
    "AVX": (
        "sandybridge",
        "+avx,+sse4.2",
        NO_AVX2,
        "Sandybridge",
        "--xla_cpu_max_isa=AVX",
        "default",
        NO_FMA,
    ),
    "AVX2": (
        "haswell",
        "+avx2,+fma,+avx,+sse4.2",
        "X86_V4 AVX512_ICL AVX512_SPR",
        "Haswell",
        "--xla_cpu_max_isa=AVX2",
        "avx2",
        "glibc.cpu.hwcaps=-AVX512F",
    ),
}
NAMES = (
    *(
        "NUMBA_CPU_NAME",
        "NUMBA_CPU_FEATURES",
        "NPY_DISABLE_CPU_FEATURES",
        "OPENBLAS_CORETYPE",
    ),
    *("XLA_FLAGS", "ATEN_CPU_CAPABILITY", "GLIBC_TUNABLES"),
)
"""Values of environment variables of other runs, without some of the instructions that processors differ by."""


def main(names: list[str]) -> None:
    """Record results again, or with `--plain` write them as they are to a folder."""
    if names[:1] == ["--plain"]:
        (folder, *names), written = names[1:], lambda name, found: found
    else:
        folder = None
        others = [tempfile.mkdtemp() for _ in PROCESSORS]
        for other, processor in zip(others, PROCESSORS.values(), strict=True):
            command = [
                sys.executable,
                "-m",
                "tests.support.recording",
                "--plain",
                other,
                *names,
            ]
            subprocess.run(
                command,
                check=True,
                env=os.environ | dict(zip(NAMES, processor, strict=True)),
            )

        def written(name: str, found: Any) -> Any:
            again = [
                json.loads((Path(other) / f"{name}.json").read_text(encoding="utf-8"))
                for other in others
            ]
            return recorded.shared(found, *again)

    for name in names or [*subjects.SUBJECTS, *studied.SUBJECTS]:
        place = subjects if name in subjects.SUBJECTS else studied
        found = studied.told(name, place.SUBJECTS[name]())
        found = rounded(json.loads(json.dumps(found, ensure_ascii=False)))
        (Path(folder or place.FOLDER) / f"{name}.json").write_text(
            recorded.lines(rounded(written(name, found))), encoding="utf-8"
        )


def rounded(value: Any) -> Any:
    """Return values with seven digits."""
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return float(f"{value:.7g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main(sys.argv[1:])
