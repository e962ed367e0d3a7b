// Case -> scene: the only place of the engine that knows the case's schema.
#pragma once

#include <filesystem>
#include <string>

#include "scene.h"

namespace bedflow {

// Reads and checks a case file. Throws Stop(invalid_case) with every fault, a line each, by path.
Scene read_scene(const std::filesystem::path& case_file);
// The same for a case's text, which must be whole: it names no file beside it.
Scene scene_of(const std::string& case_text);

}  // namespace bedflow
