#!/usr/bin/env python3
"""clang-tidy over our sources, in parallel, skipping what was clean before.

usage: tidy.py BUILD_FOLDER

BEDFLOW_TIDY_SECONDS in the environment: begin no further file after so long; those that were changed last come first.

A source is clean for as long as its text, the text of our headers that it includes (as the build recorded them) and .clang-tidy
are the same: the stamp of that is kept in BUILD_FOLDER/tidy.
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]


def sources(build, database):
    """Our compiled sources: {path: object file}, without generated code. Writes their compile commands into the folder `database`,
    without the precompiled headers, which are the compiler's own and hide what a source forgets to include."""
    found, kept = {}, []
    for entry in json.loads((build / "compile_commands.json").read_text()):
        path = pathlib.Path(entry["file"]).resolve()
        if not path.is_relative_to(ROOT) or path.is_relative_to(build.resolve()) or path in found:
            continue
        found[path] = re.search(r" -o (\S+)", entry["command"]).group(1)
        kept.append(entry | {"command": re.sub(r" -include \S+cmake_pch\S+", "", entry["command"])})
    (database / "compile_commands.json").write_text(json.dumps(kept))
    return found


def dependencies(build):
    """What ninja knows each object file to depend on, within the repository: {object file: [path]}."""
    listing = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True).stdout
    found, current = {}, None
    for line in listing.splitlines():
        if line and not line.startswith((" ", "ninja:")):
            current = found.setdefault(line.split(":")[0], [])
        elif line.strip() and current is not None:
            path = (build / line.strip()).resolve()
            if path.is_relative_to(ROOT) and not path.is_relative_to(build.resolve()):
                current.append(path)
    return found


def stamp(source, included):
    digest = hashlib.sha256((ROOT / ".clang-tidy").read_bytes())
    for path in [source, *sorted(included), *sorted((ROOT / "proto").rglob("*.proto"))]:
        digest.update(str(path).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def check(database, source):
    started = time.monotonic()
    result = subprocess.run(["clang-tidy", "-p", database, "--quiet", source], capture_output=True, text=True)
    return result.returncode == 0, result.stdout, time.monotonic() - started


def last_changed_first(paths):
    """By the commits of the repository; files that none has yet come first."""
    log = subprocess.run(["git", "-C", ROOT, "log", "--name-only", "--format="], capture_output=True, text=True).stdout
    age = {}
    for name in log.splitlines():
        age.setdefault(name, len(age) + 1)
    return sorted(paths, key=lambda path: age.get(str(path.relative_to(ROOT)), 0))


def main():
    build = pathlib.Path(sys.argv[1])
    clean = build / "tidy"
    clean.mkdir(parents=True, exist_ok=True)
    included = dependencies(build)
    todo = {}
    for source, object_file in sources(build, clean).items():
        mark = clean / stamp(source, included.get(object_file, []))
        if not mark.exists():
            todo[source] = mark
    started, faults, left = time.monotonic(), 0, 0
    limit = float(os.environ.get("BEDFLOW_TIDY_SECONDS", "inf"))

    def check_in_time(source):
        return check(clean, source) if time.monotonic() - started < limit else None

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {pool.submit(check_in_time, source): source for source in last_changed_first(todo)}
        for job in concurrent.futures.as_completed(jobs):
            source = jobs[job]
            if job.result() is None:
                left += 1
                continue
            good, text, seconds = job.result()
            if good:
                todo[source].touch()
            else:
                faults += 1
                print(f"{source.relative_to(ROOT)}:\n{text}", flush=True)
            if os.environ.get("BEDFLOW_TIDY_TIMES"):
                print(f"{seconds:6.1f} s  {source.relative_to(ROOT)}", flush=True)
    print(f"clang-tidy: {len(todo) - left} files looked at in {time.monotonic() - started:.0f} s, {faults} with faults"
          + (f"; {left} not looked at, the time was over" if left else ""))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
