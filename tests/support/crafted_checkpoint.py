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


def seal_by_hand(data, entries, manifest):
    """The bytes with checksums that fit. manifest: place and bytes of it. Nothing of HDF5 is needed for that."""
    data = bytearray(data)
    place, room = manifest
    text = text_of(entries, data)
    if len(text) > room:
        raise ValueError("the manifest has no room for this")
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
    return bytes(data)


def seal_again(path, entries=None):
    """Manifest and seal as bedflow would write them for what the file holds now. entries: to lie about it."""
    now = places(path)
    if entries is None:
        entries = [(name, *now.get(name, (place, size))) for name, place, size in manifest_entries(path)]
    path.write_bytes(seal_by_hand(path.read_bytes(), entries, now["manifest"]))


# HDF5 keeps checksums of its own in its metadata (Jenkins' lookup3). Without mending them a change gets no further than that.

def lookup3(data):
    """Jenkins 2006, hashlittle() with the seed 0."""
    mask = 0xFFFFFFFF

    def turned(value, bits):
        return ((value << bits) | (value >> (32 - bits))) & mask
    length = len(data)
    a = b = c = (0xDEADBEEF + length) & mask
    if length == 0:
        return c
    padded = bytes(data) + bytes(-length % 12)
    words = struct.unpack(f"<{len(padded) // 4}I", padded)
    for place in range(0, len(words) - 3, 3):
        a, b, c = (a + words[place]) & mask, (b + words[place + 1]) & mask, (c + words[place + 2]) & mask
        a = ((a - c) & mask) ^ turned(c, 4)
        c = (c + b) & mask
        b = ((b - a) & mask) ^ turned(a, 6)
        a = (a + c) & mask
        c = ((c - b) & mask) ^ turned(b, 8)
        b = (b + a) & mask
        a = ((a - c) & mask) ^ turned(c, 16)
        c = (c + b) & mask
        b = ((b - a) & mask) ^ turned(a, 19)
        a = (a + c) & mask
        c = ((c - b) & mask) ^ turned(b, 4)
        b = (b + a) & mask
    a, b, c = (a + words[-3]) & mask, (b + words[-2]) & mask, (c + words[-1]) & mask
    for first, second, bits in (("c", "b", 14), ("a", "c", 11), ("b", "a", 25), ("c", "b", 16), ("a", "c", 4), ("b", "a", 14),
                                ("c", "b", 24)):
        values = {"a": a, "b": b, "c": c}
        values[first] = ((values[first] ^ values[second]) - turned(values[second], bits)) & mask
        a, b, c = values["a"], values["b"], values["c"]
    return c


def metadata_blocks(data):
    """(place, bytes) of each part of HDF5's metadata that a checksum follows."""
    found = []
    for signature in (b"\x89HDF\r\n\x1a\n", b"OHDR", b"OCHK", b"FRHP", b"BTHD", b"BTLF"):
        place = data.find(signature)
        while place >= 0:
            for length in range(len(signature) + 8, min(2048, len(data) - place - 4)):
                if lookup3(data[place:place + length]) == struct.unpack_from("<I", data, place + length)[0]:
                    found.append((place, length))
                    break
            place = data.find(signature, place + 1)
    return found


def mend(data, blocks):
    """The checksums of those parts as they must be now, in place."""
    for place, length in blocks:
        struct.pack_into("<I", data, place + length, lookup3(data[place:place + length]))
