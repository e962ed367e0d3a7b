// The options of bedflowd for operators: metrics, log, retention, quotas, reserve, configuration file.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "housekeeping.h"
#include "jobs.h"

namespace bedflow::server {

struct OperatingOptions {
  std::string metrics, log = "text", reserve = "0";
  bool metrics_beyond_loopback = false;
  double ended_days = 0;
  std::uint32_t ended_checkpoints = 0;
  std::vector<std::string> quotas;
  double interval = 10;  // s
};

void add_operating_options(CLI::App& app, OperatingOptions& options);

// Sets the quotas and the reserve; the rest is for the housekeeping. Throws std::invalid_argument.
OperatingSettings operating_settings(const OperatingOptions& options, Settings& settings);

}  // namespace bedflow::server
