// The program's command line: all verbs with their options, for those who parse it and for those who complete it.
#pragma once

#include <memory>

#include "verbs.h"

namespace bedflow::client {

std::unique_ptr<CLI::App> command_line(Program& program);

}  // namespace bedflow::client
