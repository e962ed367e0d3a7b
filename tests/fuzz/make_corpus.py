#!/usr/bin/python3
"""Writes the inputs that the fuzz targets begin with, by the programs themselves: cases as `bedflow init` gives them, in text and
JSON, the logs of a small bed that has run, and the manifest of its checkpoint.

usage: /usr/bin/python3 tests/fuzz/make_corpus.py [folder of the programs, build/release/bin if absent]
"""
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
CORPUS = pathlib.Path(__file__).parent / "corpus"
BED = """
name: "seed" domain { size { x: 0.024 y: 0.048 z: 0.01 } cells { x: 8 y: 16 z: 4 }
  faces { y_low { inflow { velocity: 0.5 } } y_high { outflow {} } } }
gravity { y: -9.81 }
gas { density: 1.2 viscosity: 1.8e-5 simple {} upwind {} }
particles { diameter: 1.2e-3 density: 1000 linear_spring_dashpot { stiffness: 440 restitution: 0.9 } spring { friction: 0.1 }
  random { count: 50 seed: 1 region { low {} high { x: 0.024 y: 0.02 z: 0.01 } } } symplectic_euler {} }
coupling { gidaspow_blended {} hat {} explicit {} }
time { end: 0.002 }
monitors { name: "kinetic_energy" kinetic_energy {} interval: 0.0005 }
monitors { name: "bed_height" bed_height {} interval: 0.0005 averaging { bin: 0.0005 } }
"""


def records(log):
    """The payloads of a log's records, as fuzz_log takes them: a length of two bytes before each."""
    found, place = b"r", 0
    while place + 20 <= len(log):
        length, = struct.unpack_from("<I", log, place)
        found += struct.pack("<H", length) + log[place + 20:place + 20 + length]
        place += 20 + length
    return found


def main(programs):
    def run(*words):
        return subprocess.run([programs / words[0], *words[1:]], check=True, capture_output=True, text=True).stdout

    def write(target, name, content):
        (CORPUS / target).mkdir(parents=True, exist_ok=True)
        (CORPUS / target / name).write_bytes(content)

    for name in ("settling", "drop", "drum", "mueller", "channel"):
        write("case", name, run("bedflow", "init", name).encode())
    sys.path.insert(0, str(programs.parent / "python"))
    from bedflow import read_case
    from google.protobuf import json_format
    write("case", "bed_json", json_format.MessageToJson(read_case(BED), preserving_proto_field_name=True).encode())
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "case.txtpb").write_text(BED)
        write("case", "bed", BED.encode())
        subprocess.run([programs / "bedflow-engine", folder], check=True, capture_output=True)
        for log in ("events", "statistics"):
            content = (folder / f"{log}.log").read_bytes()[:16000]
            write("log", f"{log}_file", b"f" + content)
            write("log", f"{log}_torn", b"f" + content[:-7])
            write("log", f"{log}_records", records(content))
        checkpoint = sorted((folder / "checkpoints").glob("*.h5"))[-1].read_bytes()
        place, length = struct.unpack_from("<QQ", checkpoint, 24 + 8 + 8 + 8 + 8)
        manifest = checkpoint[place:place + length]
        write("manifest", "text", b"m" + manifest)
        write("manifest", "sealed", b"s" + manifest)
        write("manifest", "title_sealed", b"s" + manifest.partition(b"\n")[0] + b"\n")
        write("manifest", "file", b"f" + checkpoint[:1024] + manifest)


main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/release/bin")
