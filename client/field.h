// Fields and particles of a checkpoint: asked of the server, or of the files of a job folder; and their tables.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "contexts.h"
#include "table.h"

namespace bedflow::client {

struct Field {
  v1::FieldHeader header;
  std::vector<std::vector<double>> columns;  // in the order of header.columns; NaN where there is no value
};

struct FieldSource {
  std::string job;  // id, or job folder
  ServerChoice server;
  std::optional<std::uint64_t> step;  // newest good checkpoint if absent
  bool fresh = false;                 // of a running job: write one first
};

// Throws Failure.
Field ask_field(const FieldSource& source, const v1::FieldQuery& query);

// A line a cell, bin, particle or quantity; JSON has the arrays as they are shaped. histogram: the shares instead.
void print_field(const Field& field, Format format, bool histogram = false);

}  // namespace bedflow::client
