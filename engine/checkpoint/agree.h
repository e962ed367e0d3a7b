// A failure that one rank alone has seen becomes the same Stop on every rank.
#pragma once

#include <new>
#include <string>
#include <system_error>

#include "base/stop.h"
#include "parallel/comm.h"

namespace bedflow {

// Collective. Throws on every rank what the lowest rank with a failure has seen; returns when there is none.
inline void throw_alike(const Comm& comm, const Failure& failure) {
  const std::int64_t first = comm.size() - comm.max(failure ? std::int64_t{comm.size() - comm.rank()} : std::int64_t{0});
  if (first == comm.size()) return;
  const int from = static_cast<int>(first);
  const std::string reason = comm.broadcast(std::to_string(static_cast<int>(failure.reason)), from);
  throw Stop(static_cast<Reason>(std::stoi(reason)), comm.broadcast(failure.message, from));
}

// Collective. Does the work, which must not be collective itself, and throws on every rank alike when it failed on any.
template <class Work>
void do_alike(const Comm& comm, Work work) {
  Failure failure;
  try {
    work();
  } catch (const Stop& stop) {
    failure.note(stop.reason, stop.what());
  } catch (const std::bad_alloc&) {
    failure.note(Reason::out_of_memory, "out of memory while reading or writing a file");
  } catch (const std::system_error& error) {
    const bool full = error.code() == std::errc::no_space_on_device;
    failure.note(full ? Reason::disk_full : Reason::internal, error.what());
  } catch (const std::exception& error) {
    failure.note(Reason::internal, error.what());
  }
  throw_alike(comm, failure);
}

}  // namespace bedflow
