"""A real bedflowd behind TLS on loopback, with certificates and tokens of its own, and calls by the names of methods."""
import hashlib
import os
import pathlib
import secrets
import socket
import subprocess
import tempfile
import threading
import time

import bedflow
import grpc
from bedflow.v1 import access_pb2, service_pb2, service_pb2_grpc
from real_server import RealServer

CERTIFICATES = pathlib.Path(__file__).parents[2] / "deploy/certificates.sh"
SERVICE = service_pb2.DESCRIPTOR.services_by_name["JobService"]
OTHERS = {"/grpc.health.v1.Health/Check": access_pb2.READ, "/grpc.health.v1.Health/Watch": access_pb2.READ,
          "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo": access_pb2.READ}


def path_of(method):
    return f"/{method.containing_service.full_name}/{method.name}"


def make_certificates(folder, *arguments, days=2):
    subprocess.run([CERTIFICATES, folder, *arguments], check=True, capture_output=True, env={**os.environ, "DAYS": str(days)})


class Token:
    """As its holder has it: the text, and a file that the holder alone may read."""

    def __init__(self, folder, identity, secret):
        self.id, self.secret, self.text = identity, secret, f"bedflow_{identity}_{secret}"
        self.file = pathlib.Path(folder) / f"{identity}.token"
        with open(os.open(self.file, os.O_WRONLY | os.O_CREAT, 0o600), "w", encoding="ascii") as file:
            file.write(self.text + "\n")


class SecureServer(RealServer):
    """Use it in a with statement. local: calls over the socket, as whoever runs the server."""

    def __init__(self, *options, wants_certificates=False):
        self.keys = pathlib.Path(tempfile.mkdtemp(prefix="bedflow-keys-"))
        self.secrets = []
        make_certificates(self.keys, "localhost", "127.0.0.1")
        files = ["--tls-certificate", self.keys / "server.pem", "--tls-key", self.keys / "server.key"]
        if wants_certificates:
            files += ["--client-ca", self.keys / "ca.pem"]
        super().__init__("--listen", "127.0.0.1:0", *files, *options)
        self.local = service_pb2_grpc.JobServiceStub(grpc.insecure_channel(self.address))

    def start(self):
        super().start()
        self.network = "localhost:" + self.said.strip().rpartition(":")[2]

    def token(self, owner, scope, seconds=3600.0):
        identity, secret = secrets.token_hex(6), secrets.token_hex(32)
        self.secrets.append(secret)
        self.local.CreateToken(access_pb2.CreateTokenRequest(token=access_pb2.Token(
            id=identity, owner=owner, scope=scope, secret_sha256=hashlib.sha256(secret.encode()).digest(),
            expires_unix_nanos=time.time_ns() + int(seconds * 1e9))))
        return Token(self.keys, identity, secret)

    def revoke(self, token):
        self.local.RevokeToken(access_pb2.RevokeTokenRequest(id=token.id))

    def channel(self, token=None, ca=None, certificate=None):
        """A new connection. token: what is shown, a Token or any text; certificate: the name of one in the server's keys."""
        def read(name):
            return (pathlib.Path(certificate[0]) / name).read_bytes() if certificate else None
        credentials = grpc.ssl_channel_credentials((ca or self.keys / "ca.pem").read_bytes(), certificate and read(certificate[1] + ".key"),
                                                   certificate and read(certificate[1] + ".pem"))
        if token is not None:
            text = token.text if isinstance(token, Token) else token
            credentials = grpc.composite_channel_credentials(credentials, grpc.access_token_call_credentials(text))
        return grpc.secure_channel(self.network, credentials, [("grpc.use_local_subchannel_pool", 1)])

    def stub(self, token, **how):
        return service_pb2_grpc.JobServiceStub(self.channel(token, **how))

    def connect_as(self, token):
        return bedflow.connect(self.network, ca=self.keys / "ca.pem", token=token.file)

    def rss(self):
        """Bytes of memory that the server has."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) * 1024


class SlowWay:
    """A port of this machine that leads to another, as from afar: what goes through is so many seconds under way. In a with statement."""

    def __init__(self, port, seconds):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._target, self._seconds = port, seconds

    def __enter__(self):
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self):
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self._target))
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source, sink):
        with source:
            try:
                while said := source.recv(1 << 16):
                    time.sleep(self._seconds)  # the way itself, not a wait for anything
                    sink.sendall(said)
                sink.shutdown(socket.SHUT_WR)
            except OSError:
                pass


def outcome(channel, path, request=b"", metadata=(), seconds=20):
    """How a call of a method by its path ends: its code and its message; OK when the first answer is there."""
    call = channel.stream_stream(path)(iter([request]), timeout=seconds, metadata=metadata)
    try:
        for _ in call:
            call.cancel()
            break
        return grpc.StatusCode.OK, ""
    except grpc.RpcError as failure:
        return failure.code(), failure.details()


def reason_of(failure):
    """The stable reason of a refused call, from its details or, where it was turned away at the door, from its message."""
    detail = service_pb2.ErrorDetail()
    for key, value in failure.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            detail.ParseFromString(value)
    return detail.reason or failure.details().rpartition("[")[2].rstrip("]")
