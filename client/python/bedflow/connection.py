"""The channel to a server, and its refusals as exceptions."""
from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Iterator
from typing import Any

import grpc

from bedflow.v1 import service_pb2, service_pb2_grpc

from .contexts import Context, read_pem, read_token

CALL_SECONDS = 60.0
LARGEST_MESSAGE = 512 << 20

# Calls that may be made twice: a server that has just been started again is asked again.
_REPEATED = ("CreateJob", "GetJob", "ListJobs", "ListSeries", "QueryStatistics", "ListCheckpoints", "GetCheckpoint",
             "VerifyCheckpoint", "DownloadCheckpoint", "QueryField", "GetSnapshot", "GetServerInfo")
_SERVICE = json.dumps({"methodConfig": [{
    "name": [{"service": "bedflow.v1.JobService", "method": method} for method in _REPEATED],
    "retryPolicy": {"maxAttempts": 4, "initialBackoff": "0.1s", "maxBackoff": "0.5s", "backoffMultiplier": 2,
                    "retryableStatusCodes": ["UNAVAILABLE"]}}]})


@dataclasses.dataclass(frozen=True)
class Fault:
    """What is wrong with one field of a case or a request."""

    path: str
    text: str


class Error(Exception):
    """A call that was refused or did not get through. reason is stable: JOB_NOT_FOUND, INVALID_CASE, UNAVAILABLE ..."""

    def __init__(self, reason: str, message: str, next_command: str = "", faults: tuple[Fault, ...] = ()):
        lines = [f"{message} [{reason}]", *(f"  {fault.path}: {fault.text}" for fault in faults)]
        super().__init__("\n".join(lines + ([f"  next: {next_command}"] if next_command else [])))
        self.reason = reason
        self.message = message
        self.next = next_command
        self.faults = faults


def error_of(failure: grpc.RpcError) -> Error:
    """The server's own words, if it had any."""
    detail = service_pb2.ErrorDetail()
    for key, value in failure.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            detail.ParseFromString(value)
    faults = tuple(Fault(fault.path, fault.text) for fault in detail.faults)
    message = failure.details() or "no answer"
    at_the_door = re.search(r" \[([A-Z_]+)\]$", message)  # turned away before the request was read: no details
    if at_the_door and not detail.reason:
        return Error(at_the_door[1], message[:at_the_door.start()])
    return Error(detail.reason or failure.code().name, message, detail.next, faults)


def may_come_back(error: Error) -> bool:
    """Whether the server is away, not the question wrong."""
    return error.reason in ("UNAVAILABLE", "CANCELLED", "GOING_DOWN")


def _channel(context: Context, options: list[tuple[str, Any]]) -> grpc.Channel:
    """Over TLS whenever the way leaves the machine, or the context has something for TLS; with its token on every call."""
    if not context.wants_tls:
        return grpc.insecure_channel(context.server, options)
    credentials = grpc.ssl_channel_credentials(
        read_pem(context.ca) if context.ca else None, read_pem(context.key, is_private=True) if context.key else None,
        read_pem(context.certificate) if context.certificate else None)
    if context.token:
        credentials = grpc.composite_channel_credentials(credentials, grpc.access_token_call_credentials(read_token(context.token)))
    return grpc.secure_channel(context.server, credentials, options)


class Connection:
    """A channel and its calls; each call raises Error."""

    def __init__(self, context: Context):
        self.address = context.server
        # min_reconnect_backoff is how long one attempt may take, in gRPC's words: a handshake over a network, or on a busy machine.
        options = [("grpc.max_receive_message_length", LARGEST_MESSAGE), ("grpc.enable_http_proxy", 0),
                   ("grpc.keepalive_time_ms", 30_000), ("grpc.initial_reconnect_backoff_ms", 100),
                   ("grpc.min_reconnect_backoff_ms", 10_000 if context.wants_tls else 1000), ("grpc.max_reconnect_backoff_ms", 1000),
                   ("grpc.service_config", _SERVICE)]
        self._channel = _channel(context, options)
        self.stub = service_pb2_grpc.JobServiceStub(self._channel)

    def close(self) -> None:
        self._channel.close()

    def call(self, method: Callable[..., Any], request: Any, seconds: float = CALL_SECONDS) -> Any:
        try:
            return method(request, timeout=seconds)
        except grpc.RpcError as failure:
            raise error_of(failure) from None

    def stream(self, method: Callable[..., Any], request: Any) -> Iterator[Any]:
        """The answers of a call that streams. Closing the iterator ends the call."""
        call = method(request)
        try:
            yield from call
        except grpc.RpcError as failure:
            raise error_of(failure) from None
        finally:
            call.cancel()
