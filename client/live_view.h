// A job followed before the user's eyes: bar, states, checkpoints and warnings on stderr, events as JSON lines on stdout.
#pragma once

#include "progress.h"
#include "table.h"
#include "watch.h"

namespace bedflow::client {

struct LiveOptions {
  WatchPlan plan;
  Format format = Format::table;  // json and jsonl: every event on stdout
  std::function<void()> lost = [] {};
  std::vector<std::string> detached;  // told after Ctrl-C: how to come back
};

struct LiveEnd {
  Exit exit;
  v1::Job job;
};

LiveEnd view_job(const Connection& connection, const std::string& id, const LiveOptions& options, Interrupt& interrupt);

// "checkpoint of step 120, t = 0.05 s, 3.1 MiB"; empty for progress and states.
std::string event_line(const v1::Event& event);

}  // namespace bedflow::client
