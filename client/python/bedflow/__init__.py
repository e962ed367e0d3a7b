"""bedflow from Python: submit beds, watch them, and have their results as numpy arrays.

    import bedflow

    with bedflow.connect() as server:                       # or connect("unix:/path/bedflowd.sock"), connect(context="lab")
        job = server.submit("case.txtpb", ranks=2)
        job.wait()
        height = job.statistics()["bed_height"]             # .time, .value, .mean, .half_width
        voids = job.slice("gas_fraction", axis="z")         # .values["gas_fraction"][y, x], .axes["x"]
        solids = job.reduce("solids_fraction")["solids_fraction"].integral

Everything is SI. A call that is refused raises bedflow.Error with a stable reason, what helps next, and all faults of a case.
"""
from .connection import Error, Fault
from .contexts import Context, default_address, read_context
from .results import Average, Field, Profile, Reduced, Series
from .server import Job, Server, connect, read_case

__all__ = ["Average", "Context", "Error", "Fault", "Field", "Job", "Profile", "Reduced", "Series", "Server", "connect", "default_address",
           "read_case", "read_context"]
