// Names of checkpoint files: checkpoint_<step, 10 digits>.h5, and while one is written checkpoint_<step>.epoch<attempt>.partial,
// so that two attempts at a job never write into one file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace bedflow {

std::string checkpoint_name(std::uint64_t step);
std::string kept_name(std::uint64_t step);  // of the mark beside a checkpoint that stays when newer ones come
std::string partial_name(std::uint64_t step, std::uint32_t epoch);
// Nothing for a file with another kind of name.
std::optional<std::uint64_t> step_of_checkpoint(const std::filesystem::path& path);
std::optional<std::uint32_t> attempt_of_partial(const std::filesystem::path& path);

// The highest number among the names in attempts/ of a job's folder; 0: there is none.
std::uint64_t newest_attempt(const std::filesystem::path& job);

}  // namespace bedflow
