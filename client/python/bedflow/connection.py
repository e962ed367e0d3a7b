"""The channel to a server, and its refusals as exceptions."""
from __future__ import annotations

import dataclasses
import json
import os
import pathlib
from collections.abc import Callable, Iterator
from typing import Any

import grpc

from bedflow.v1 import service_pb2, service_pb2_grpc

CALL_SECONDS = 60.0
LARGEST_MESSAGE = 512 << 20

# Calls that may be made twice: a server that has just been started again is asked again.
_REPEATED = ("CreateJob", "GetJob", "ListJobs", "ListSeries", "QueryStatistics", "ListCheckpoints", "GetCheckpoint",
             "VerifyCheckpoint", "DownloadCheckpoint", "QueryField", "GetSnapshot", "GetServerInfo")
_SERVICE = json.dumps({"methodConfig": [{
    "name": [{"service": "bedflow.v1.JobService", "method": method} for method in _REPEATED],
    "retryPolicy": {"maxAttempts": 4, "initialBackoff": "0.1s", "maxBackoff": "0.5s", "backoffMultiplier": 2,
                    "retryableStatusCodes": ["UNAVAILABLE"]}}]})


def default_address() -> str:
    """BEDFLOW_SERVER, or the socket where a bedflowd without options listens."""
    if address := os.environ.get("BEDFLOW_SERVER"):
        return address
    state = os.environ.get("XDG_STATE_HOME") or pathlib.Path.home() / ".local/state"
    return f"unix:{pathlib.Path(state) / 'bedflow/bedflowd.sock'}"


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
    return Error(detail.reason or failure.code().name, failure.details() or "no answer", detail.next, faults)


def may_come_back(error: Error) -> bool:
    """Whether the server is away, not the question wrong."""
    return error.reason in ("UNAVAILABLE", "CANCELLED", "GOING_DOWN")


class Connection:
    """A channel and its calls; each call raises Error."""

    def __init__(self, address: str):
        self.address = address
        options = [("grpc.max_receive_message_length", LARGEST_MESSAGE), ("grpc.enable_http_proxy", 0),
                   ("grpc.keepalive_time_ms", 30_000), ("grpc.initial_reconnect_backoff_ms", 100),
                   ("grpc.min_reconnect_backoff_ms", 100), ("grpc.max_reconnect_backoff_ms", 1000), ("grpc.service_config", _SERVICE)]
        self._channel = grpc.insecure_channel(address, options)
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
