"""Requests of ill will: ids that would be paths, texts that are too long, bytes that are no message. No method has an answer to
them but a refusal, and the server goes on; methods and fields are those of the schema, so that later ones are tried too."""
import os
import pathlib
import random
import socket
import unittest

import bedflow
import grpc
from bedflow.v1 import service_pb2, service_pb2_grpc
from google.protobuf.descriptor import FieldDescriptor
from real_server import RealServer, bed
from secure_server import SERVICE, outcome, path_of

Code = grpc.StatusCode
SEED = int(os.environ.get("BEDFLOW_SEED", random.SystemRandom().randrange(1 << 32)))
HOSTILE = ["../../../../etc/passwd", "..", "/etc/passwd", "j-00000000000\0", "j-../../../../x", "%2e%2e%2f", "j-" + "0" * 12 + "/..",
           "j-0123456789AB", "\u202ej-000000000000", "'; DROP TABLE jobs; --", "\r\ninjected: header", "$(touch injected)", "{}%s%n",
           "x" * 100_000]


def setUpModule():
    global server, job, local
    server = unittest.enterModuleContext(RealServer())
    with server.connect() as there:
        job = there.submit(bed(end=0.002)).wait(60).id
    local = grpc.insecure_channel(server.address, [("grpc.max_send_message_length", -1)])
    print("BEDFLOW_SEED", SEED)


def tree():
    """Every name below the server's folder, but for those that it makes for itself while it runs."""
    return {str(path) for path in server.path.rglob("*") if "catalogue" not in path.name}


def texts_of(message, depth=0):
    """Requests like this one, each with a hostile text in one of its fields, messages within it too."""
    for field in message.DESCRIPTOR.fields:
        is_map = field.message_type and field.message_type.GetOptions().map_entry
        if field.cpp_type == FieldDescriptor.CPPTYPE_STRING and field.type == FieldDescriptor.TYPE_STRING:
            for text in HOSTILE:
                changed = type(message)()
                changed.CopyFrom(message)
                if field.label == FieldDescriptor.LABEL_REPEATED:
                    getattr(changed, field.name).append(text)
                else:
                    setattr(changed, field.name, text)
                yield f"{field.name}={text[:30]!r}", changed
        elif field.message_type and not is_map and field.label != FieldDescriptor.LABEL_REPEATED and depth < 1 and field.name != "case":
            for name, inner in texts_of(getattr(message, field.name), depth + 1):
                changed = type(message)()
                changed.CopyFrom(message)
                getattr(changed, field.name).CopyFrom(inner)
                yield f"{field.name}.{name}", changed


class Hostile(unittest.TestCase):
    def tearDown(self):
        self.assertIsNone(server.process.poll(), "the server is gone")
        code, message = outcome(local, path_of(SERVICE.methods_by_name["GetServerInfo"]))
        self.assertEqual(code, Code.OK, message)

    def test_texts_in_any_field_of_any_method_are_refused_or_found_nowhere(self):
        before, refused = tree(), 0
        for method in SERVICE.methods:
            request = method.input_type._concrete_class()
            for name, hostile in texts_of(request):
                with self.subTest(method=method.name, field=name):
                    code, message = outcome(local, path_of(method), hostile.SerializeToString())
                    self.assertIn(code, {Code.OK, Code.INVALID_ARGUMENT, Code.NOT_FOUND, Code.UNIMPLEMENTED, Code.FAILED_PRECONDITION}, message)
                    self.assertLess(len(message), 2000)
                    self.assertFalse(any(ord(letter) < 32 for letter in message), message)
                    if name.startswith(("id=", "name.job=", "start_from.job=")):
                        self.assertIn(code, {Code.INVALID_ARGUMENT, Code.NOT_FOUND, Code.UNIMPLEMENTED}, "a job was found by that name")
                    refused += code != Code.OK
        self.assertGreater(refused, 200)
        self.assertEqual(tree(), before, "a request has left something on the disk")
        self.assertFalse(pathlib.Path("injected").exists())

    def test_messages_that_are_too_large_are_refused_by_their_length(self):
        request = service_pb2.CreateJobRequest()
        request.case.description = "x" * (33 << 20)
        self.assertEqual(outcome(local, path_of(SERVICE.methods_by_name["CreateJob"]), request.SerializeToString())[0], Code.RESOURCE_EXHAUSTED)

    def test_bytes_that_are_no_message_are_refused_by_every_method(self):
        source = random.Random(SEED)
        deep = b"\x0a\x00"
        for _ in range(500):  # nested beyond what any message is
            deep = b"\x0a" + bytes([len(deep) & 0x7F | 0x80, len(deep) >> 7]) + deep
        for method in SERVICE.methods:
            for garbage in (b"\xff" * 10, b"\x0a\xff\xff\xff\xff\x0f", deep, *(source.randbytes(source.randrange(1, 300)) for _ in range(20))):
                code, message = outcome(local, path_of(method), garbage)
                self.assertNotIn(code, {Code.INTERNAL, Code.DEADLINE_EXCEEDED, Code.UNAVAILABLE}, (method.name, garbage[:40], message))

    def test_good_requests_with_flipped_bits_crash_nothing(self):
        source = random.Random(SEED + 1)
        good = {"GetJob": service_pb2.GetJobRequest(id=job, with_case=True), "QueryStatistics": service_pb2.QueryStatisticsRequest(id=job),
                "GetCheckpoint": service_pb2.GetCheckpointRequest(name=service_pb2.CheckpointName(job=job)),
                "DownloadCheckpoint": service_pb2.DownloadCheckpointRequest(name=service_pb2.CheckpointName(job=job), offset=7),
                "CreateJob": service_pb2.CreateJobRequest(case=bedflow.read_case(bed(end=0.002)), validate_only=True)}
        for name, request in good.items():
            content = request.SerializeToString()
            for _ in range(10 if name == "CreateJob" else 40):
                flipped = bytearray(content)
                for _ in range(source.randrange(1, 4)):
                    flipped[source.randrange(len(flipped))] ^= 1 << source.randrange(8)
                code, message = outcome(local, path_of(SERVICE.methods_by_name[name]), bytes(flipped))
                self.assertNotIn(code, {Code.UNAVAILABLE, Code.DEADLINE_EXCEEDED}, message)

    def test_what_is_no_http_2_is_cut_off(self):
        source = random.Random(SEED + 2)
        preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
        for said in (b"GET / HTTP/1.1\r\n\r\n", b"\0" * 1000, source.randbytes(1000), preface + source.randbytes(1000),
                     preface + b"\xff\xff\xff\x00\x00\x00\x00\x00\x00", preface + b"\x00\x00\x00\x04\x00\x00\x00\x00\x00" + b"\x00\x40\x00\x01\x04\x00\x00\x00\x01" + b"\x82" * 0x4000):
            with socket.socket(socket.AF_UNIX) as one:
                one.connect(server.address.removeprefix("unix:"))
                one.settimeout(20)
                try:
                    one.sendall(said)
                    one.shutdown(socket.SHUT_WR)
                    while one.recv(4096):
                        pass
                except (ConnectionResetError, BrokenPipeError):
                    pass

    def test_headers_that_are_too_large_or_odd_are_refused(self):
        path = path_of(SERVICE.methods_by_name["GetServerInfo"])
        with grpc.insecure_channel(server.address) as own:  # which may be cut off
            self.assertNotEqual(outcome(own, path, metadata=[("x", "y" * 100_000)])[0], Code.OK)
        self.assertEqual(outcome(local, path, metadata=[("bedflow-caller", "admin"), ("x-bin", bytes(range(256)))])[0], Code.OK)

    def test_uploads_that_lie_are_refused_and_leave_nothing(self):
        stub = service_pb2_grpc.JobServiceStub(local)
        before = tree()
        head = service_pb2.ImportCheckpointRequest.Head
        for parts in ([], [{"data": b"x"}], [{"head": head(bytes=1 << 62)}], [{"head": head(bytes=10)}, {"offset": 5, "data": b"x" * 5}],
                      [{"head": head(bytes=10)}, {"offset": 0, "data": b"x" * 5, "crc32c": 1}], [{"head": head(bytes=1)}, {"head": head(bytes=1)}],
                      [{"head": head(bytes=4)}, {"offset": 0, "data": b"\x89HDF"}], [{"head": head(bytes=0)}]):
            with self.subTest(parts=str(parts)[:80]), self.assertRaises(grpc.RpcError) as caught:
                stub.ImportCheckpoint(iter([service_pb2.ImportCheckpointRequest(**part) for part in parts]), timeout=60)
            self.assertIn(caught.exception.code(), {Code.INVALID_ARGUMENT, Code.RESOURCE_EXHAUSTED, Code.DATA_LOSS}, caught.exception.details())
        self.assertEqual(tree(), before)


if __name__ == "__main__":
    unittest.main()
