"""Checks that files of a run are what other programs expect of them, read with h5py.

  check_plot_file.py FILE...    .hdf: VTKHDF 1.0; .hdf.series: ParaView's file series; .h5: checkpoint
Prints each fault and exits 1 when there is one.
"""
import json
import pathlib
import sys

import h5py
import numpy

VTK_VERTEX = 1


class Fault(Exception):
    pass


def need(condition, text):
    if not condition:
        raise Fault(text)


def check_text(attributes, name, value):
    need(name in attributes, f"attribute {name} is missing")
    kind = attributes.get_id(name).get_type()
    need(isinstance(kind, h5py.h5t.TypeStringID) and not kind.is_variable_str(), f"{name} is not a text of fixed length")
    need(kind.get_cset() == h5py.h5t.CSET_ASCII, f"{name} is not ASCII")
    need(attributes[name] == value.encode(), f"{name} is {attributes[name]!r}, not {value!r}")


def check_array(dataset, count):
    need(dataset.shape in [(count,), (count, 3)], f"{dataset.name} has the shape {dataset.shape}, not {count} values or vectors")
    need(dataset.chunks is None and dataset.attrs["unit"], f"{dataset.name} has no unit")


def check_gas(root):
    check_text(root.attrs, "GridDescription", "XYZ")
    need(root.attrs["Origin"].shape == (3,), "Origin is not a point")
    level = root["Level0"]
    need(level.attrs["Spacing"].shape == (3,) and (level.attrs["Spacing"] > 0).all(), "Spacing is not three lengths")
    need("Level1" not in root, "there is more than one level")
    need(level["AMRBox"].shape == (1, 6) and level["AMRBox"].dtype == numpy.int32, "AMRBox is not one box of 32-bit integers")
    box = level["AMRBox"][0].reshape(3, 2)
    cells = int((box[:, 1] - box[:, 0] + 1).prod())
    need(level["CellData"].keys(), "there are no cell data")
    need("PointData" in level and "FieldData" in level, "a group that the reader looks for is missing")
    for dataset in level["CellData"].values():
        check_array(dataset, cells)


def check_particles(root):
    count = root["Points"].shape[0]
    need(root["Points"].shape == (count, 3), "Points are not positions")
    for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"]:
        need(root[name].shape == (1,) and root[name][0] == count, f"{name} is not {count}")
    need((root["Connectivity"][:] == numpy.arange(count)).all(), "Connectivity is not one point a cell")
    need((root["Offsets"][:] == numpy.arange(count + 1)).all(), "Offsets are not one point a cell")
    need(root["Types"].dtype == numpy.uint8 and (root["Types"][:] == VTK_VERTEX).all() and root["Types"].shape == (count,),
         "Types are not vertices")
    for dataset in root["PointData"].values():
        check_array(dataset, count)


def check_plot(path):
    with h5py.File(path, "r") as file:
        root = file["VTKHDF"]
        need(list(root.attrs["Version"]) == [1, 0], "Version is not 1.0")
        if root.attrs["Type"] == b"OverlappingAMR":
            check_text(root.attrs, "Type", "OverlappingAMR")
            check_gas(root)
        else:
            check_text(root.attrs, "Type", "UnstructuredGrid")
            check_particles(root)


def check_series(path):
    series = json.loads(path.read_text())
    need(series["file-series-version"] == "1.0", "file-series-version is not 1.0")
    times = [entry["time"] for entry in series["files"]]
    need(times and times == sorted(set(times)), f"the times do not rise: {times}")
    for entry in series["files"]:
        need((path.parent / entry["name"]).exists(), f"{entry['name']} is not there")
        check_plot(path.parent / entry["name"])


def check_checkpoint(path):
    with h5py.File(path, "r") as file:
        for name in ["format_version", "build_version", "step", "time", "ranks"]:
            need(name in file.attrs, f"attribute {name} is missing")
        manifest = bytes(file["manifest"][:]).decode().splitlines()
        places = {line.split()[0]: int(line.split()[1], 16) for line in manifest[1:]}
        found = []

        def visit(name, item):
            if isinstance(item, h5py.Dataset) and name != "manifest":
                found.append(name)
                need("unit" in item.attrs and "meaning" in item.attrs, f"{name} has no unit or meaning")
                need(item.chunks is None, f"{name} is not contiguous")
                # In a file with a user block h5py tells places from the file's start, as the manifest does.
                need(item.size == 0 or item.id.get_offset() == places.get(name), f"{name} is not where the manifest says")

        file.visititems(visit)
        need(sorted(found) == sorted(places), "manifest and datasets differ")
        if "gas/pressure" in file:
            need(file["gas/pressure"].ndim == 3, "gas/pressure is not three-dimensional")
        for name in file.get("rank_offsets/particles", {}):
            offsets = file["rank_offsets/particles"][name][:]
            need(len(offsets) == file.attrs["ranks"] + 1 and offsets[-1] == len(file["particles"][name]),
                 f"rank offsets of particles/{name} do not end with its rows")


def check(path):
    kinds = {".hdf": check_plot, ".series": check_series, ".h5": check_checkpoint}
    try:
        kinds[path.suffix](path)
    except (Fault, KeyError, OSError, ValueError) as fault:
        return [f"{path}: {fault}"]
    return []


if __name__ == "__main__":
    FAULTS = [fault for name in sys.argv[1:] for fault in check(pathlib.Path(name))]
    for FAULT in FAULTS:
        print(FAULT)
    sys.exit(1 if FAULTS or len(sys.argv) < 2 else 0)
