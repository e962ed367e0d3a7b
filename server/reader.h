// Checkpoints are opened by bedflow-reader, a process of its own for each question, with bounded time and memory, and only so
// many at once: what is in a file can at worst end the process that reads it.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "folder.h"
#include "process.h"

namespace bedflow::server {

struct ReaderSettings {
  std::filesystem::path program;
  std::uint32_t memory_mib = 4096;
  std::chrono::seconds time{60};
};

class Readers {
 public:
  explicit Readers(ReaderSettings settings) : settings_(std::move(settings)) {}

  // Throw Refusal: checkpoint_corrupt, reader_failed, too_much, backend_error.
  v1::CheckpointReport describe(const std::filesystem::path& file);
  std::vector<v1::Fault> verify(const std::filesystem::path& file);  // none: it is good
  // Makes folder/case.txtpb and a checkpoint of a file from outside. Throws invalid_case too.
  v1::CheckpointReport import(const std::filesystem::path& file, const std::filesystem::path& folder);

  // An answer as it comes. Throws bad_request too, when the question makes no sense.
  class Answering {
   public:
    std::optional<v1::FieldAnswer> next();  // nothing: that was all

   private:
    friend class Readers;
    Answering(Readers& all, const std::filesystem::path& file, const std::vector<std::string>& command);
    Readers& all_;
    const std::filesystem::path file_;
    std::shared_ptr<void> place_;
    Child child_;
    const Child::Deadline deadline_;
    std::size_t bytes_ = 0;
  };
  std::unique_ptr<Answering> ask(const std::filesystem::path& file, const v1::FieldQuery& query);

 private:
  std::vector<std::string> command(const char* question, const std::filesystem::path& file) const;
  std::string answer(const char* question, const std::filesystem::path& file, const std::string& more = {});
  [[noreturn]] void refuse(const Answer& answer, const std::filesystem::path& file) const;
  std::shared_ptr<void> take_place();  // throws Refusal(too_much)

  const ReaderSettings settings_;
  std::counting_semaphore<> places_{8};
};

// The step that is named, or else the newest that `works`: it throws Refusal(checkpoint_corrupt) for one that is not good. Throws
// Refusal: checkpoint_not_found, checkpoint_corrupt with what is wrong with each.
void with_checkpoint(const JobFolder& folder, const v1::CheckpointName& name,
                     const std::function<void(std::uint64_t step, const std::filesystem::path& file)>& works);

}  // namespace bedflow::server
