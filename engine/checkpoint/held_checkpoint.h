// A checkpoint that was never written: the content as each rank holds it, for other blocks to take up.
#pragma once

#include "checkpoint/checkpoint.h"
#include "parallel/comm.h"

namespace bedflow {

class HeldCheckpoint : public CheckpointSource {
 public:
  HeldCheckpoint(const Comm& comm, CheckpointContent content) : comm_(comm), content_(std::move(content)) {}

  std::uint64_t step() const override { return content_.step; }
  double time() const override { return content_.time; }
  int ranks() const override { return comm_.size(); }
  double number(const std::string& name) const override { return content_.numbers.at(name); }
  bool has(const std::string& array) const override { return find(array) != nullptr; }
  std::vector<double> grid(const std::string& array, const GridPart& part) const override;
  std::vector<double> rows(const std::string& array) const override;
  std::vector<std::int64_t> integer_rows(const std::string& array) const override;

 private:
  const CheckpointArray* find(const std::string& array) const;

  Comm comm_;
  CheckpointContent content_;
};

}  // namespace bedflow
