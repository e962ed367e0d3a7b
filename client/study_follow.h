// A study before the user's eyes: how far its runs are, on stderr, until it has ended.
#pragma once

#include <optional>
#include <string>

#include "connection.h"
#include "embedded_server.h"
#include "interrupt.h"
#include "study_report.h"

namespace bedflow::client {

std::string progress_of(const v1::Study& study);  // "3 of 12 runs have ended; now substeps=5 at 43 %"
v1::Study get_study(const Connection& connection, const std::string& id);

// Nothing: interrupted. `own` is started again should it die.
std::optional<v1::Study> follow_study(const Connection& connection, const std::string& id, Interrupt& interrupt,
                                      EmbeddedServer* own);

}  // namespace bedflow::client
