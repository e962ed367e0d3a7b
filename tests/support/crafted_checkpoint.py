"""Checkpoints that somebody has changed and sealed again: right to the checksum, wrong inside. The layout is that of
engine/checkpoint/seal.h."""
import struct

import h5py
from bedflow.checksum import crc32c

SEAL_BYTES = 512
BLOCK_BYTES = 1 << 20
TITLE = b"bedflow manifest: dataset, place, bytes, CRC32C of each block of 1048576 bytes\n"
MAGIC = b"bedflow checkpoint\n".ljust(24, b"\0")


def manifest_entries(path):
    """(name, place, bytes) of each dataset, as the manifest has them."""
    with h5py.File(path) as file:
        lines = bytes(file["manifest"][()]).splitlines()[1:]
    return [(words[0].decode(), int(words[1], 16), int(words[2], 16)) for words in (line.split() for line in lines)]


def places(path):
    """Where each dataset of the file lies now."""
    found = {}
    with h5py.File(path) as file:
        def take(name, entry):
            if isinstance(entry, h5py.Dataset) and entry.size > 0 and entry.id.get_offset() is not None:
                found[name] = (entry.id.get_offset(), entry.id.get_storage_size())
        file.visititems(take)
    return found


def text_of(entries, data):
    lines = [TITLE]
    for name, place, size in entries:
        sums = [crc32c(data[start:min(start + BLOCK_BYTES, place + size)]) for start in range(place, place + size, BLOCK_BYTES)]
        lines.append(b" ".join([name.encode(), b"%016x" % place, b"%016x" % size, *(b"%08x" % one for one in sums)]) + b"\n")
    return b"".join(lines)


def seal_again(path, entries=None):
    """Manifest and seal as bedflow would write them for what the file holds now. entries: to lie about it."""
    now = places(path)
    if entries is None:
        entries = [(name, now[name][0], now[name][1]) if name in now else (name, place, size)
                   for name, place, size in manifest_entries(path)]
    data = bytearray(path.read_bytes())
    place, room = now["manifest"]
    text = text_of(entries, data)
    if len(text) > room:
        raise ValueError("the manifest has no room for this")
    text = text.ljust(room, b"\n")[:room] if len(text) == room else text
    data[place:place + len(text)] = text
    known = sorted([(0, SEAL_BYTES), (place, len(text)), (len(data), 0), *((start, size) for _, start, size in entries if size)])
    metadata, done = b"", 0
    for start, size in known:
        metadata += bytes(data[done:max(start, done)])
        done = max(done, start + size)
    step, time = struct.unpack_from("<Qd", data, 32)
    seal = struct.pack("<24sQQdQQQII", MAGIC, 1, step, time, len(data), place, len(text), crc32c(text), crc32c(metadata))
    seal = seal.ljust(SEAL_BYTES - 4, b"\0")
    data[:SEAL_BYTES] = seal + struct.pack("<I", crc32c(seal))
    path.write_bytes(data)
