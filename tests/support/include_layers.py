#!/usr/bin/env python3
"""Who may include whom (engine/README.md). Reads every #include of a tree and lists those that are forbidden.

usage: include_layers.py [ROOT]
"""
import pathlib
import re
import sys

# A part is a folder of the engine, the engine's own top ("engine"), or another top folder. It may include itself and these.
ALLOWED = {
    "engine/base": set(),
    "engine/models": {"engine/base"},
    "engine/geometry": {"engine/base"},
    "engine/parallel": {"engine/base"},
    "engine/grid": {"engine/base", "engine/parallel"},
    "engine/particles": {"engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/geometry"},
    "engine/gas": {"engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/geometry"},
    "engine/coupling": {"engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/gas", "engine/particles"},
    "engine/statistics": {"engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/particles"},
    "engine/checkpoint": {"engine/base", "engine/parallel"},
    "engine/fields": {"engine/base", "engine/parallel", "engine/checkpoint"},
    "engine/report": {"engine", "engine/base", "engine/parallel", "engine/statistics", "engine/fields", "proto"},
    "engine/case": {"engine", "engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/geometry", "engine/gas",
                    "engine/particles", "engine/coupling", "engine/statistics", "proto"},
    "engine": {"engine/base", "engine/parallel", "engine/grid", "engine/models", "engine/geometry", "engine/gas",
               "engine/particles", "engine/coupling", "engine/statistics", "engine/checkpoint", "engine/fields", "engine/case", "engine/report"},
    "proto": set(),
    "server": {"proto"},
    "client": {"proto"},
}

# Headers that belong to few: (pattern of the include, who may, why).
RESERVED = [
    (r"mpi\.h", r"engine/parallel/comm\.cpp", "MPI is in parallel/comm.cpp and nowhere else"),
    (r"(hdf5|H5\w*)\.h", r"engine/checkpoint/.*", "HDF5 is in engine/checkpoint/ and nowhere else"),
    (r"bedflow/v1/case(_\w+)?\.pb\.h|case_file\.h", r"(engine/case|proto|server|client|tests)/.*",
     "the engine knows the case's message in engine/case/ only"),
    (r"bedflow/v1/(job|results|fields)\.pb\.h|(record_log|statistics_file)\.h", r"(engine/report|proto|server|client|tests)/.*",
     "the engine knows the job folder's messages in engine/report/ only"),
    (r"bedflow/v1/service\..*pb\.h|grpc(pp)?/.*", r"(server|client|tests)/.*", "gRPC is for server and client"),
    (r"google/protobuf/.*", r"(engine/(case|report)|proto|server|client|tests)/.*",
     "protobuf is for engine/case/, engine/report/ and what stands outside the engine"),
    (r"sqlite3\.h", r"(server|tests/service)/.*", "the store is the server's"),
]

FOLDERS = ("engine", "proto", "server", "client", "tests")


def part_of(path):
    """The part that a file belongs to, from its path below the root."""
    steps = path.split("/")
    return "/".join(steps[:2]) if steps[0] == "engine" and len(steps) > 2 else steps[0]


def resolve(root, source, include):
    """Path below the root of an included file of ours; None for anybody else's."""
    if include.startswith("bedflow/v1/"):
        return "proto/" + include
    for folder in (str(pathlib.PurePosixPath(source).parent), *FOLDERS):
        if (root / folder / include).is_file():
            return f"{folder}/{include}"
    return None


def faults(root):
    """All forbidden includes below root, as 'path:line: what'."""
    root = pathlib.Path(root)
    found = []
    paths = [p for folder in FOLDERS for p in sorted((root / folder).rglob("*")) if p.suffix in (".h", ".cpp")]
    for path in paths:
        source = path.relative_to(root).as_posix()
        part = part_of(source)
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
            if not match:
                continue
            include = match.group(1)
            for pattern, who, why in RESERVED:
                if re.fullmatch(pattern, include) and not re.fullmatch(who, source):
                    found.append(f"{source}:{number}: {include}: {why}")
            target = resolve(root, source, include)
            if target is None or part == "tests":
                continue
            if part not in ALLOWED:
                found.append(f"{source}:{number}: {part} has no place among the layers; give it one in {pathlib.Path(__file__).name}")
            elif part_of(target) not in ALLOWED[part] | {part}:
                found.append(f"{source}:{number}: {part} must not include {target}")
    if not paths:
        found.append(f"{root}: no sources here")
    return found


if __name__ == "__main__":
    listing = faults(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2])
    print("\n".join(listing) or "every include keeps to the layers")
    sys.exit(1 if listing else 0)
