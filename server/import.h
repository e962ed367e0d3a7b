// A checkpoint that a client sends becomes a suspended job.
#pragma once

#include <grpcpp/grpcpp.h>

#include <boost/asio/thread_pool.hpp>
#include <functional>

#include "door.h"
#include "jobs.h"
#include "reader.h"

namespace bedflow::server {

// The stream of one import. gRPC owns what this returns, until it is done with it. done: called then.
grpc::ServerReadReactor<v1::ImportCheckpointRequest>* open_import(Jobs& jobs, Readers& readers, const Door& door,
                                                                  boost::asio::thread_pool& pool,
                                                                  grpc::CallbackServerContext* context, v1::Job* response,
                                                                  std::function<void()> done);

}  // namespace bedflow::server
