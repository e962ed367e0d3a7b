// A study to keep: what was asked, a line a run, where the time goes, a picture; and all of it as JSON for programs.
#pragma once

#include <filesystem>

#include "bedflow/v1/study.pb.h"

namespace bedflow::client {

// Writes folder/NAME.md, NAME.png and NAME.json, by the study's name; returns the page's path. Throws Failure.
std::filesystem::path write_study_page(const std::filesystem::path& folder, const v1::Study& study);

}  // namespace bedflow::client
