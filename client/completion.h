// What may come next on a command line: verbs, options, and what the server knows by name.
#pragma once

#include <string>
#include <vector>

#include "verbs.h"

namespace bedflow::client {

struct Completion {
  struct Candidate {
    std::string text, note;
  };
  std::vector<Candidate> candidates;  // each begins with the word as it is
  bool files = false;                 // or a file
};

// line: up to the cursor, with the program's name. A server that does not answer at once has nothing to say.
Completion complete(CLI::App& app, const std::string& line, const ServerChoice& otherwise);

}  // namespace bedflow::client
