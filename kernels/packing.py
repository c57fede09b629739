"""`python -m towatlas.kernels.packing`: what numba's front end makes of the kernels, into the package.

A zip of LLVM bitcode, a file a kernel, not optimised, for no processor of a kind in particular; about.json says of
which sources, and by what. `kernels.building` uses it where it fits. `make bitcode` makes it anew, whenever a source
changes.
"""

import importlib.metadata
import json
import platform
import zipfile

from llvmlite import binding as llvm

from towatlas.kernels import calls
from towatlas.kernels.building import ABOUT, PACKED, front_end
from towatlas.kernels.native import source_hash

# The same bytes whenever it is made.
EPOCH = (1980, 1, 1, 0, 0, 0)


def main() -> None:
    """Write the file."""
    found: dict[str, tuple[str, bytes]] = {}
    for kernel in calls.KERNELS:
        made = front_end(kernel)
        if made is None:
            raise SystemExit(f"numba {importlib.metadata.version('numba')} keeps to itself what it hands to LLVM")
        found[f"{kernel.module}.{kernel.name}"] = made[0], _anywhere(made[1])
    about = {
        "sources": source_hash(),
        "triple": llvm.get_process_triple(),
        "llvm": llvm.llvm_version_info[0],
        "numba": importlib.metadata.version("numba"),
        "python": platform.python_version(),
        "symbols": {name: symbol for name, (symbol, _) in found.items()},
    }
    content: dict[str, str | bytes] = {ABOUT: json.dumps(about, indent=1)}
    content |= {name: code for name, (_, code) in found.items()}
    with zipfile.ZipFile(PACKED, "w") as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, EPOCH), data, zipfile.ZIP_LZMA)
    print(f"{PACKED}: {len(found)} kernels, {PACKED.stat().st_size / 1e6:.2f} MB")


def _anywhere(code: bytes) -> bytes:
    """Without the folder that numba is in, which exceptions would name."""
    folder = str(importlib.metadata.distribution("numba").locate_file(""))
    return llvm.parse_assembly(str(llvm.parse_bitcode(code)).replace(folder, "/" * len(folder))).as_bitcode()


if __name__ == "__main__":
    main()
