// What the pages of studies and of reproduced beds share.
#pragma once

#include <filesystem>
#include <string>

namespace bedflow::client {

std::string made_by(const std::string& command);  // "Made by `...`, bedflow 0.1.0, 2026-01-31.", a line

void make_folder(const std::filesystem::path& folder);                        // throws Failure
void write_text(const std::filesystem::path& file, const std::string& text);  // throws Failure

}  // namespace bedflow::client
