"""Which server, and what is shown to it: the contexts of the `bedflow` command, and the files that they name."""
from __future__ import annotations

import dataclasses
import os
import pathlib
import re
import stat

from google.protobuf import text_format

from bedflow.v1 import context_pb2

PathLike = str | os.PathLike[str]


@dataclasses.dataclass(frozen=True)
class Context:
    """A server's address; files with the authorities that may vouch for it, the client's own certificate and key, and its token."""

    server: str
    ca: PathLike | None = None
    certificate: PathLike | None = None
    key: PathLike | None = None
    token: PathLike | None = None

    @property
    def wants_tls(self) -> bool:
        is_near = re.match(r"(unix:|localhost:|\[::1\]:|127\.[0-9.]+:)", self.server)
        return not is_near or any((self.ca, self.certificate, self.key, self.token))


def default_address() -> str:
    """BEDFLOW_SERVER, or the socket where a bedflowd without options listens."""
    if address := os.environ.get("BEDFLOW_SERVER"):
        return address
    state = os.environ.get("XDG_STATE_HOME") or pathlib.Path.home() / ".local/state"
    return f"unix:{pathlib.Path(state) / 'bedflow/bedflowd.sock'}"


def read_context(name: str | None = None) -> Context:
    """A context by its name; else that of BEDFLOW_CONTEXT, the server of BEDFLOW_SERVER, the context in use, the default socket."""
    name = name or os.environ.get("BEDFLOW_CONTEXT")
    if not name and os.environ.get("BEDFLOW_SERVER"):
        return Context(default_address())
    folder = os.environ.get("XDG_CONFIG_HOME") or pathlib.Path.home() / ".config"
    path = pathlib.Path(folder) / "bedflow/contexts.txtpb"
    contexts = context_pb2.Contexts()
    if path.exists():
        text_format.Parse(path.read_text(encoding="utf-8"), contexts)
    name = name or contexts.current
    if not name:
        return Context(default_address())
    for one in contexts.contexts:
        if one.name == name:
            return Context(one.server, one.ca or None, one.certificate or None, one.key or None, one.token or None)
    raise KeyError(f"there is no context {name!r} in {path}; bedflow context list")


def _read(path: PathLike, is_private: bool) -> bytes:
    with open(path, "rb") as file:
        mode = os.fstat(file.fileno())
        if is_private and mode.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise PermissionError(f"{os.fspath(path)} can be read by others, and is not used; chmod 600 it")
        if is_private and mode.st_uid != os.geteuid():
            raise PermissionError(f"{os.fspath(path)} belongs to another user, and is not used")
        return file.read(1 << 20)


def read_pem(path: PathLike, is_private: bool = False) -> bytes:
    """A certificate, or a private key, which nobody else may be able to read (PermissionError)."""
    text = _read(path, is_private)
    if b"-----BEGIN " not in text:
        raise ValueError(f"{os.fspath(path)} is not in PEM (-----BEGIN ...)")
    return text


def read_token(path: PathLike) -> str:
    """The token of a file that nobody else may be able to read (PermissionError)."""
    text = _read(path, is_private=True).decode("ascii", "replace").rstrip()
    if not re.fullmatch(r"bedflow_[0-9a-f]{12}_[0-9a-f]{64}", text):
        raise ValueError(f"{os.fspath(path)} has no token of bedflow and nothing else; bedflow server token create OWNER --out FILE")
    return text
