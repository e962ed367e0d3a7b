// Jobs and checkpoints as tables.
#pragma once

#include "bedflow/v1/service.pb.h"
#include "table.h"

namespace bedflow::client {

template <class Messages>
std::vector<const google::protobuf::Message*> pointers(const Messages& messages) {
  std::vector<const google::protobuf::Message*> all;
  all.reserve(static_cast<std::size_t>(messages.size()));
  for (const auto& message : messages) all.push_back(&message);
  return all;
}

Table table_of(const std::vector<v1::Job>& jobs);  // a line a job
Table table_of(const v1::Job& job);                // a line a property
Table table_of(const std::vector<v1::Checkpoint>& checkpoints);

}  // namespace bedflow::client
